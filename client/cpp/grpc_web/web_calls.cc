#include "client/cpp/grpc_web/web_calls.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/grpc_web/grpc_web.h"

namespace lpdeform::client {
namespace {

constexpr char kService[] = "/lpdeform.v1.DeformService/";
/// Longer deadlines are as good as none. The header of a deadline has room for eight digits.
constexpr std::chrono::milliseconds kLongest = std::chrono::hours(24);

/// One call: what has come of its answer.
struct Answer {
  AnswerReader reader;
  CallEvents events;
  absl::Status broken;  // the answer cannot be read
};

HttpEvents http_events(const std::shared_ptr<Answer>& answer) {
  const auto taken = [answer](absl::Status read) {
    answer->broken.Update(std::move(read));
    return answer->broken.ok() ? Taking::kTaken : Taking::kRefused;
  };
  return {
      .header = [answer, taken](std::string_view name,
                                std::string_view value) { return taken(answer->reader.header(name, value)); },
      .bytes =
          [answer, taken](std::string_view bytes) {
            if (answer->events.has_room && !answer->events.has_room()) return Taking::kLater;
            return taken(answer->reader.bytes(bytes, answer->events.message));
          },
      .end =
          [answer](const absl::Status& transport) {
            if (!answer->broken.ok()) return answer->events.end(answer->broken);
            answer->events.end(transport.ok() ? answer->reader.status() : transport);
          }};
}

/// The end of a call that a thread waits for.
class Waiting {
 public:
  void message(std::string message) {
    const std::scoped_lock lock(mutex_);
    message_ = std::move(message);
  }
  void end(absl::Status status) {
    const std::scoped_lock lock(mutex_);
    status_ = std::move(status);
    changed_.notify_all();
  }
  absl::StatusOr<std::string> wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return status_.has_value(); });
    if (!status_->ok()) return *status_;
    if (!message_) return absl::InternalError("The answer has no message.");
    return *std::move(message_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::string> message_;
  std::optional<absl::Status> status_;
};

}  // namespace

std::shared_ptr<HttpCall> Calls::start(const std::string& method,
                                       const google::protobuf::MessageLite& request,
                                       std::chrono::milliseconds limit, CallEvents events) const {
  HttpRequest http{.path = absl::StrCat(kService, method),
                   .headers = headers_of(caller_),
                   .body = framed(request.SerializeAsString()),
                   .limit = std::min(limit, kLongest)};
  http.headers.emplace_back("content-type", "application/grpc-web+proto");
  http.headers.emplace_back("accept", "application/grpc-web+proto");
  http.headers.emplace_back("x-grpc-web", "1");
  if (limit.count() > 0) http.headers.emplace_back("grpc-timeout", absl::StrCat(http.limit.count(), "m"));
  const auto answer = std::make_shared<Answer>();
  answer->events = std::move(events);
  return http_->post(std::move(http), http_events(answer));
}

absl::StatusOr<std::string> Calls::wait(const std::string& method,
                                        const google::protobuf::MessageLite& request,
                                        std::chrono::milliseconds limit, const std::stop_token& stop) const {
  const auto waiting = std::make_shared<Waiting>();
  const std::shared_ptr<HttpCall> call =
      start(method, request, limit,
            {.has_room = {},
             .message = [waiting](std::string message) { waiting->message(std::move(message)); },
             .end = [waiting](const absl::Status& status) { waiting->end(status); }});
  const std::stop_callback cancel(stop, [&call] { call->cancel(); });
  return waiting->wait();
}

}  // namespace lpdeform::client
