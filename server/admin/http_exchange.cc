#include "server/admin/http_exchange.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace lpdeform {
namespace {

const char* phrase_of(int status) {
  if (status == 200) return "OK";
  if (status == 400) return "Bad Request";
  if (status == 403) return "Forbidden";
  if (status == 404) return "Not Found";
  if (status == 431) return "Request Header Fields Too Large";
  return "Service Unavailable";
}

/// -1 if there is nothing at the moment; 0 at the end of the input.
ssize_t received(int fd, std::array<char, 4096>& buffer) {
  const ssize_t got = recv(fd, buffer.data(), buffer.size(), 0);
  const bool is_later = got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
  return got < 0 && !is_later ? 0 : got;
}

}  // namespace

HttpExchange::HttpExchange(int fd, Clock::duration patience)
    : fd_(fd), patience_(patience), until_(Clock::now() + patience) {}

HttpExchange::~HttpExchange() {
  close(fd_);
}

short HttpExchange::events() const {
  if (state_ == State::kReading) return POLLIN;
  if (state_ == State::kWriting) return written_ < out_.size() ? POLLOUT : POLLIN;
  return 0;
}

void HttpExchange::go_on() {
  if (state_ == State::kReading) read();
  if (state_ == State::kWriting) write();
}

void HttpExchange::read() {
  std::array<char, 4096> buffer;
  const ssize_t got = received(fd_, buffer);
  if (got == 0) state_ = State::kOver;
  if (got <= 0) return;
  in_.append(buffer.data(), static_cast<std::size_t>(got));
  const std::size_t end = in_.find("\r\n\r\n");
  if (end != std::string::npos && end <= kLongestRequest) return parse(in_.substr(0, end));
  if (in_.size() > kLongestRequest) refuse(431);
}

/// METHOD SP TARGET SP HTTP/1.x, then headers.
void HttpExchange::parse(const std::string& head) {
  const std::vector<absl::string_view> lines = absl::StrSplit(head, "\r\n");
  const std::string line(lines.front());
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  if (first == std::string::npos || last == first || line.compare(last, 8, " HTTP/1.") != 0)
    return refuse(400);
  const std::string method = line.substr(0, first);
  is_head_ = method == "HEAD";
  const std::string target = line.substr(first + 1, last - first - 1);
  if (is_head_ || method == "GET") path_ = target.substr(0, target.find('?'));
  int hosts = 0;
  for (absl::string_view header : absl::MakeConstSpan(lines).subspan(1)) {
    if (!absl::StartsWithIgnoreCase(header, "host:")) continue;
    host_ = ++hosts == 1 ? std::string(absl::StripAsciiWhitespace(header.substr(5))) : std::string();
  }
  state_ = State::kAsked;
  until_ = Clock::time_point::max();
}

void HttpExchange::refuse(int status) {
  answer(status, "text/plain", "");
}

void HttpExchange::answer(int status, const std::string& content_type, const std::string& body) {
  out_ = absl::StrCat("HTTP/1.1 ", status, " ", phrase_of(status), "\r\nContent-Type: ", content_type,
                      "\r\nContent-Length: ", body.size(),
                      "\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n");
  if (!is_head_) out_ += body;
  state_ = State::kWriting;
  until_ = Clock::now() + patience_;
}

/// Closing a socket with unread input would discard the answer, so the peer closes first.
void HttpExchange::write() {
  while (written_ < out_.size()) {
    const ssize_t put = send(fd_, out_.data() + written_, out_.size() - written_, MSG_NOSIGNAL);
    if (put < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (put < 0) state_ = State::kOver;
    if (put < 0) return;
    written_ += static_cast<std::size_t>(put);
    if (written_ == out_.size()) shutdown(fd_, SHUT_WR);
  }
  std::array<char, 4096> buffer;
  if (received(fd_, buffer) == 0) state_ = State::kOver;
}

}  // namespace lpdeform
