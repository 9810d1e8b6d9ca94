#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/calls/frame_calls.h"
#include "server/calls/write_pump.h"
#include "server/wire/encode.h"

namespace lpdeform {
namespace {

constexpr int kMostStreams = 16;

absl::Status wrong_count(int count) {
  return make_fault({Reason::kStreamsCount, "streams", absl::StrCat("1 to ", kMostStreams)},
                    absl::StrCat("A call asks for ", count, " streams, not for 1 to ", kMostStreams, "."));
}

/// Streams of several sessions in one call. The streams take turns message by message, so that none waits for
/// another's frames.
class StreamSessionsCall final
    : public WritePump<StreamSessionsReactor, Outgoing<v1::StreamSessionsResponse>> {
 public:
  explicit StreamSessionsCall(Backend& backend) : backend_(backend) {}

  void begin(const v1::StreamSessionsRequest& request) {
    if (request.streams_size() < 1 || request.streams_size() > kMostStreams) {
      return refuse(wrong_count(request.streams_size()));
    }
    auto self = std::static_pointer_cast<StreamSessionsCall>(shared_from_this());
    if (!backend_.pool().try_post([self, request] { self->fetch(request, 0); }))
      refuse(server_busy(backend_.pool().expected_wait()));
  }

 private:
  struct Lane {
    Backend::OpenStream open;  // its stream is null if it could not be opened
    absl::Status refusal;      // why it could not be opened; OK once the client was told
    bool is_over = false;
  };

  /// Restores the sessions from the store one after another. A failure is reported when the stream is opened.
  void fetch(const v1::StreamSessionsRequest& request, int from) {
    if (from == request.streams_size()) return open_all(request);
    auto self = std::static_pointer_cast<StreamSessionsCall>(shared_from_this());
    backend_.with_session(context(), Backend::Access::kRead, request.streams(from).session(),
                          [self, request, from](const auto& session) {
                            self->sessions_.push_back(session);
                            self->fetch(request, from + 1);
                          });
  }

  void open_all(const v1::StreamSessionsRequest& request) {
    std::vector<Lane> lanes;
    for (const v1::StreamFramesRequest& one : request.streams()) {
      const auto pump = [weak = weak_from_this()] {
        if (const auto self = weak.lock()) self->pump();
      };
      const auto& session = sessions_[lanes.size()];
      auto open = session.ok() ? backend_.open_stream(context(), *session, "", one.options(), pump)
                               : session.status();
      if (!open.ok()) record().refused(open.status(), {});
      lanes.push_back({open.ok() ? *std::move(open) : Backend::OpenStream{}, open.status(), false});
    }
    const std::scoped_lock lock(mutex_);
    lanes_ = std::move(lanes);
    if (is_over_locked()) return forget_all();
    pump_locked();
  }

  Made make(Outgoing<v1::StreamSessionsResponse>& response) override {
    for (std::size_t tried = 0; tried < lanes_.size(); ++tried) {
      const std::size_t turn = next_++ % lanes_.size();
      response.message.set_stream(static_cast<std::uint32_t>(turn));
      if (!make_of(lanes_[turn], response)) continue;
      for (const Lane& lane : lanes_) {
        if (!lane.is_over) return Made::kMessage;
      }
      return Made::kLastMessage;
    }
    return Made::kNothing;
  }

  static bool make_of(Lane& lane, Outgoing<v1::StreamSessionsResponse>& response) {
    if (lane.is_over) return false;
    if (lane.open.stream == nullptr) {
      refuse_lane(lane, response.message);
      return true;
    }
    const std::optional<Note> note = lane.open.stream->next();
    if (!note) return false;
    lane.is_over = std::holds_alternative<EndNote>(*note);
    encode(*note, *lane.open.stream, lane.open.session()->vertex_count(), response);
    return true;
  }

  /// Sends the fault first, then the end.
  static void refuse_lane(Lane& lane, v1::StreamSessionsResponse& response) {
    if (!lane.refusal.ok()) {
      encode(FaultNote{std::exchange(lane.refusal, absl::OkStatus()), 0},
             *response.mutable_event()->mutable_fault());
      return;
    }
    v1::GoAway& go_away = *response.mutable_event()->mutable_go_away();
    go_away.set_reason(v1::GO_AWAY_REASON_NOT_OPENED);
    go_away.set_text("The stream could not be opened.");
    lane.is_over = true;
  }

  void release() override { forget_all(); }

  void forget_all() {
    for (Lane& lane : lanes_) {
      if (lane.open.stream) backend_.forget(context(), lane.open, how_ended_locked());
    }
    lanes_.clear();
  }

  Backend& backend_;
  std::vector<absl::StatusOr<std::shared_ptr<Session>>> sessions_;  // one per stream, or an error
  std::vector<Lane> lanes_;
  std::size_t next_ = 0;  // counts turns; modulo the lanes it gives the next lane
};

}  // namespace

StreamSessionsReactor* stream_sessions(Backend& backend, std::shared_ptr<CallRecord> record,
                                       const v1::StreamSessionsRequest& request) {
  return begin_call<StreamSessionsCall>(backend, std::move(record), request);
}

}  // namespace lpdeform
