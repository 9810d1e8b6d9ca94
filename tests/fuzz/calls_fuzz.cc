// libFuzzer: a schedule of calls (schedule.proto) by two callers to a server's backend, from the decoding of messages to
// running sessions; everything except gRPC. A caller must not find, see or change anything of the other. A call that does not
// end in half a minute counts as hanging.

#include <chrono>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <google/protobuf/message.h>

#include "core/base/check.h"
#include "server/calls/backend.h"
#include "server/keeping/snapshot.h"
#include "server/wire/encode.h"
#include "server/wire/frame_slices.h"
#include "tests/fuzz/proto_mutator.h"
#include "tests/fuzz/schedule.pb.h"

namespace {

using namespace lpdeform;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::size_t kMostCalls = 40, kMostStreams = 4, kMostNotes = 64;
constexpr std::chrono::seconds kPatience{30};

ServerOptions small_options() {
  ServerOptions options;
  options.threads = 1;
  options.runner_threads = 2;
  options.max_sessions = 4;
  options.max_uploads = 8;
  options.max_handles = 64;
  options.max_vertices = 2000;
  options.max_bytes = 64 << 20;
  options.max_upload_bytes = 1 << 20;
  return options;
}

/// Lives through all inputs, as a server does.
Backend& backend() {
  static auto& result = *new Backend(small_options());
  return result;
}

absl::Status wait(std::future<absl::Status> done) {
  LPDEFORM_CHECK(done.wait_for(kPatience) == std::future_status::ready);
  absl::Status status = done.get();
  LPDEFORM_CHECK(status.ok() || !status.message().empty());
  return status;
}

/// As certificates of clients tell them apart.
CallContext caller(bool is_second) {
  CallContext context;
  context.peer_identity = is_second ? "second" : "first";
  return context;
}

/// A `done` for calls that end later, and the end.
struct Ending {
  std::shared_ptr<std::promise<absl::Status>> promise = std::make_shared<std::promise<absl::Status>>();
  Backend::Done done() const {
    return [promise = promise](absl::Status status) { promise->set_value(std::move(status)); };
  }
  absl::Status wait() const { return ::wait(promise->get_future()); }
};

/// The newest of what calls refer to.
class Schedule {
 public:
  void run(const fuzz::Schedule& schedule) {
    std::size_t count = 0;
    for (fuzz::Call call : schedule.calls()) {
      if (++count > kMostCalls) break;
      name(call);
      by_ = call.caller() % 2;
      make(call);
      read_streams();
    }
  }

  ~Schedule() {
    for (std::size_t k = 0; k < streams_.size(); ++k)
      backend().forget(callers_[streams_by_[k]], streams_[k], {});
    for (const std::string& session : sessions_) {
      v1::DeleteSessionRequest request;
      request.set_session(session);
      v1::DeleteSessionResponse response;
      const Ending ending;
      backend().delete_session(callers_[owners_[session]], request, response, ending.done());
      LPDEFORM_CHECK(ending.wait().ok());
    }
    for (const std::string& upload : uploads_) {
      v1::DeleteUploadRequest request;
      request.set_upload(upload);
      v1::DeleteUploadResponse response;
      (void)backend().delete_upload(callers_[owners_[upload]], request, response);
    }
  }

 private:
  static std::string newest(const std::vector<std::string>& names) {
    return names.empty() ? "none" : names.back();
  }

  /// Names of few letters, which no server gives, become those of what is there.
  void name(Message& message) const {
    const auto& reflection = *message.GetReflection();
    std::vector<const FieldDescriptor*> fields;
    reflection.ListFields(message, &fields);
    const auto& descriptor = *message.GetDescriptor();
    for (int k = 0; k < descriptor.field_count(); ++k) {
      const FieldDescriptor& field = *descriptor.field(k);
      if (field.is_repeated() || field.type() != FieldDescriptor::TYPE_STRING) continue;
      if (field.containing_oneof() && !reflection.HasField(message, &field)) continue;
      if (reflection.GetString(message, &field).size() > 4) continue;
      if (field.name() == "session") reflection.SetString(&message, &field, newest(sessions_));
      if (field.name() == "upload") reflection.SetString(&message, &field, newest(uploads_));
      if (field.name() == "writer_token") reflection.SetString(&message, &field, token_);
      if (field.name() == "stream_id" && !streams_.empty())
        reflection.SetString(&message, &field, streams_.back().stream->id());
    }
    for (const FieldDescriptor* field : fields) {
      if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
      if (!field->is_repeated()) {
        name(*reflection.MutableMessage(&message, field));
        continue;
      }
      for (int k = 0; k < reflection.FieldSize(message, field); ++k)
        name(*reflection.MutableRepeatedMessage(&message, field, k));
    }
  }

  const CallContext& context() const { return callers_[by_]; }

  /// It is there, and who calls did not make it.
  bool is_others(const std::string& name) const {
    const auto owner = owners_.find(name);
    return owner != owners_.end() && owner->second != by_;
  }

  void made(std::vector<std::string>& names, const std::string& name) {
    names.push_back(name);
    owners_[name] = by_;
  }

  /// For whoever made it.
  bool is_there(const std::string& session) const {
    const std::size_t owner = owners_.at(session);
    return backend().find(callers_[owner], Backend::Access::kRead, session).ok();
  }

  /// What a call about a session begins with. Somebody else's is not found.
  absl::StatusOr<std::shared_ptr<Session>> found(Backend::Access access, const std::string& name) const {
    const auto waiting = std::make_shared<std::promise<absl::StatusOr<std::shared_ptr<Session>>>>();
    backend().with_session(context(), access, name, [waiting](auto session) { waiting->set_value(session); });
    auto ended = waiting->get_future();
    LPDEFORM_CHECK(ended.wait_for(kPatience) == std::future_status::ready);
    auto session = ended.get();
    if (is_others(name)) LPDEFORM_CHECK(!session.ok());
    return session;
  }

  template <typename Request, typename Response>
  absl::Status later(void (Backend::*call)(const CallContext&, const Request&, Response&, Backend::Done),
                     const Request& request, Response& response) {
    const Ending ending;
    (backend().*call)(context(), request, response, ending.done());
    return ending.wait();
  }

  /// A call about a session, which of somebody else's says that there is none.
  template <typename Request, typename Response>
  void about_session(void (Backend::*call)(const CallContext&, const Request&, Response&, Backend::Done),
                     const Request& request, Response& response) {
    const absl::Status status = later(call, request, response);
    if (is_others(request.session())) LPDEFORM_CHECK(!status.ok());
  }

  void make(const fuzz::Call& call) {
    switch (call.call_case()) {
      case fuzz::Call::kCreateUpload: {
        v1::CreateUploadResponse response;
        if (backend().create_upload(context(), call.create_upload(), response).ok())
          made(uploads_, response.upload());
        return;
      }
      case fuzz::Call::kUploadPart: {
        v1::UploadPartResponse response;
        const absl::Status status = backend().upload_part(context(), call.upload_part(), response);
        if (is_others(call.upload_part().upload())) LPDEFORM_CHECK(!status.ok());
        return;
      }
      case fuzz::Call::kDeleteUpload: {
        v1::DeleteUploadResponse response;
        (void)backend().delete_upload(context(), call.delete_upload(), response);
        return;
      }
      case fuzz::Call::kCreateSession: {
        v1::CreateSessionResponse response;
        (void)later(&Backend::create_session, call.create_session(), response);
        if (!response.has_session()) return;
        made(sessions_, response.session().name());
        token_ = response.writer_token();
        return;
      }
      case fuzz::Call::kGetSession: {
        v1::GetSessionResponse response;
        return about_session(&Backend::get_session, call.get_session(), response);
      }
      case fuzz::Call::kListSessions: {
        v1::ListSessionsResponse response;
        (void)later(&Backend::list_sessions, call.list_sessions(), response);
        for (const v1::Session& session : response.sessions()) LPDEFORM_CHECK(!is_others(session.name()));
        return;
      }
      case fuzz::Call::kDeleteSession: {
        v1::DeleteSessionResponse response;
        const std::string& session = call.delete_session().session();
        const bool was_there = is_others(session) && is_there(session);
        (void)later(&Backend::delete_session, call.delete_session(), response);
        if (was_there) LPDEFORM_CHECK(is_there(session));
        return;
      }
      case fuzz::Call::kAcquireWriter: {
        v1::AcquireWriterResponse response;
        about_session(&Backend::acquire_writer, call.acquire_writer(), response);
        if (!response.writer_token().empty()) token_ = response.writer_token();
        return;
      }
      case fuzz::Call::kUpdateHandles: {
        v1::UpdateHandlesResponse response;
        return about_session(&Backend::update_handles, call.update_handles(), response);
      }
      case fuzz::Call::kAckFrames: {
        v1::AckFramesResponse response;
        return about_session(&Backend::ack_frames, call.ack_frames(), response);
      }
      case fuzz::Call::kOpenStream: {
        const v1::DeformOpen& open = call.open_stream();
        if (streams_.size() >= kMostStreams) return;
        const auto session = found(Backend::Access::kRead, open.session());
        if (!session.ok()) return;
        auto stream = backend().open_stream(context(), *session, open.writer_token(), open.options(), [] {});
        if (!stream.ok()) return;
        streams_.push_back(*std::move(stream));
        streams_by_.push_back(by_);
        return;
      }
      case fuzz::Call::kUndoUpdate: {
        v1::UndoUpdateResponse response;
        return about_session(&Backend::undo_update, call.undo_update(), response);
      }
      case fuzz::Call::kTakeBetter: {
        v1::TakeBetterShapeResponse response;
        return about_session(&Backend::take_better_shape, call.take_better(), response);
      }
      case fuzz::Call::kRestore:
        return restore(call.restore());
      case fuzz::Call::kSnapshot: {
        const auto session = found(Backend::Access::kChange, call.snapshot().session());
        if (!session.ok()) return;
        const auto file = backend().snapshot(context(), **session);
        if (!file.ok() || file->bytes.size() > (1u << 20)) return;
        LPDEFORM_CHECK(restore_file(file->bytes).ok());  // what the server wrote it reads
        return;
      }
      case fuzz::Call::kSolve:
        return solve(call.solve());
      case fuzz::Call::CALL_NOT_SET:
        return;
    }
  }

  /// A file that somebody made up, sealed as the server does it.
  void restore(const stored::Snapshot& snapshot) {
    const std::string content = snapshot.SerializePartialAsString();
    (void)restore_file(snapshot_header(content) + content);
  }

  absl::Status restore_file(const std::string& file) {
    v1::RestoreSessionRequest request;
    request.mutable_snapshot()->set_inline_(file);
    v1::RestoreSessionResponse response;
    const auto done = std::make_shared<std::promise<absl::Status>>();
    backend().restore_session(context(), request, response,
                              [done](const absl::Status& status) { done->set_value(status); });
    auto ended = done->get_future();
    LPDEFORM_CHECK(ended.wait_for(kPatience) == std::future_status::ready);
    const absl::Status status = ended.get();
    if (status.ok()) {
      made(sessions_, response.session().name());
      token_ = response.writer_token();
    }
    // There may be no room; otherwise it is what is wrong with the file.
    return absl::IsResourceExhausted(status) ? absl::OkStatus() : status;
  }

  /// With a bound on its iterations, which is no bound of the service's.
  void solve(v1::SolveRequest request) {
    auto& solver = *request.mutable_update()->mutable_settings()->mutable_solver();
    if (solver.max_iterations() == 0 || solver.max_iterations() > 20) solver.set_max_iterations(20);
    const auto session = found(Backend::Access::kChange, request.session());
    if (!session.ok()) return;
    const Ending ending;
    std::shared_ptr<SolveJob> job;
    const absl::Status status = backend().solve(
        context(), {*session, (*session)->writer(request.writer_token())}, request,
        [](const SolveProgress&) {},
        [done = ending.done()](const absl::StatusOr<SolveResult>& result) {
          if (result.ok()) LPDEFORM_CHECK(result->frame->surface->positions().allFinite());
          done(result.status());
        },
        job);
    if (status.ok()) (void)ending.wait();
  }

  /// What a reader would be sent.
  void read_streams() {
    for (const Backend::OpenStream& open : streams_) {
      for (std::size_t k = 0; k < kMostNotes; ++k) {
        const auto note = open.stream->next();
        if (!note) break;
        Outgoing<v1::DeformResponse> response;
        encode(*note, *open.stream, open.session()->vertex_count(), response);
        LPDEFORM_CHECK(response.ByteSizeLong() < (1u << 22));
        (void)open.stream->acknowledge(open.stream->last_frame_seq());
      }
    }
  }

  const std::vector<CallContext> callers_ = {caller(false), caller(true)};
  std::size_t by_ = 0;                         // who calls now
  std::map<std::string, std::size_t> owners_;  // who made a session or an upload
  std::vector<std::string> sessions_, uploads_;
  std::string token_ = "none";
  std::vector<Backend::OpenStream> streams_;
  std::vector<std::size_t> streams_by_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Schedule schedule;
  if (!schedule.ParseFromArray(data, static_cast<int>(size))) return -1;
  Schedule().run(schedule);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  fuzz::Schedule schedule;
  if (!schedule.ParseFromArray(data, static_cast<int>(size))) schedule.Clear();
  std::mt19937 random(seed);
  for (int tries = 0; tries < 8; ++tries) {
    fuzz::Schedule changed = schedule;
    fuzz::mutate(changed, random);
    const std::string bytes = changed.SerializePartialAsString();
    if (bytes.size() > max_size || bytes.size() == 0) continue;
    std::copy(bytes.begin(), bytes.end(), data);
    return bytes.size();
  }
  return size;
}

/// The calls of two schedules, one after the other or interleaved.
extern "C" std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* data1, std::size_t size1,
                                                 const std::uint8_t* data2, std::size_t size2,
                                                 std::uint8_t* out, std::size_t max_size, unsigned seed) {
  fuzz::Schedule one, two, result;
  if (!one.ParseFromArray(data1, static_cast<int>(size1)) ||
      !two.ParseFromArray(data2, static_cast<int>(size2)))
    return 0;
  std::mt19937 random(seed);
  for (int i = 0, j = 0; i < one.calls_size() || j < two.calls_size();) {
    const bool takes_first = j == two.calls_size() || (i < one.calls_size() && (random() & 1) != 0);
    *result.add_calls() = takes_first ? one.calls(i++) : two.calls(j++);
  }
  const std::string bytes = result.SerializePartialAsString();
  if (bytes.size() > max_size) return 0;
  std::copy(bytes.begin(), bytes.end(), out);
  return bytes.size();
}
