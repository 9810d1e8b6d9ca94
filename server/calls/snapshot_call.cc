#include "server/calls/snapshot_call.h"

#include <algorithm>
#include <utility>

#include "server/calls/write_pump.h"

namespace lpdeform {
namespace {

/// Makes the file once, then sends it part by part as fast as the client takes the parts.
class SnapshotCall final
    : public WritePump<grpc::ServerWriteReactor<v1::SnapshotSessionResponse>, v1::SnapshotSessionResponse> {
 public:
  explicit SnapshotCall(Backend& backend) : backend_(backend) {}

  void begin(const v1::SnapshotSessionRequest& request) {
    auto self = std::static_pointer_cast<SnapshotCall>(shared_from_this());
    const auto task = [self, name = request.session()] {
      self->backend_.with_session(self->context(), Backend::Access::kChange, name,
                                  [self](const auto& session) {
                                    session.ok() ? self->start(**session) : self->refuse(session.status());
                                  });
    };
    if (!backend_.pool().try_post(task)) refuse(server_busy(backend_.pool().expected_wait()));
  }

 private:
  static constexpr std::size_t kPartBytes = 1u << 20;

  void start(const Session& session) {
    auto file = backend_.snapshot(context(), session);
    if (!file.ok()) return refuse(file.status());
    const std::scoped_lock lock(mutex_);
    if (is_over_locked()) return;
    file_ = *std::move(file);
    pump_locked();
  }

  Made make(v1::SnapshotSessionResponse& response) override {
    if (file_.bytes.empty()) return Made::kNothing;
    const std::size_t size = std::min(kPartBytes, file_.bytes.size() - sent_);
    response.set_size_bytes(file_.bytes.size());
    response.set_offset(sent_);
    response.set_data(file_.bytes.data() + sent_, size);
    sent_ += size;
    return sent_ == file_.bytes.size() ? Made::kLastMessage : Made::kMessage;
  }

  void release() override { file_ = {}; }

  Backend& backend_;
  Backend::SnapshotFile file_;
  std::size_t sent_ = 0;
};

}  // namespace

grpc::ServerWriteReactor<v1::SnapshotSessionResponse>* snapshot_session(
    Backend& backend, std::shared_ptr<CallRecord> record, const v1::SnapshotSessionRequest& request) {
  return begin_call<SnapshotCall>(backend, std::move(record), request);
}

}  // namespace lpdeform
