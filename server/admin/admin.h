#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace lpdeform {

/// A few pages over plain HTTP for operators: read only and without authentication, for private networks.
/// Answers GET and HEAD. If it listens on an address of this machine alone, it answers only requests that
/// name this machine: see names_this_machine(). One thread waits for all connections, so slow connections do
/// not block others. Each page is made by a thread of its own, so one page does not block another.
class Admin {
 public:
  struct Answer {
    int status = 200;
    std::string content_type;
    std::string body;
  };
  using Page = std::function<Answer()>;

  /// How long a peer may take to send its request, and again to take the answer.
  static constexpr std::chrono::milliseconds kPatience{5000};
  /// Limit of connections that wait for their peers. Beyond it, the oldest of them is closed for a new one.
  static constexpr std::size_t kMostPatient = 128;

  /// `address`: HOST:PORT, port 0 for a free one; `pages`: by their paths ("/metrics"). Requests for a page
  /// that is being made are answered together by its next run. Errors: UNAVAILABLE ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Admin>> start(const std::string& address,
                                                      const std::map<std::string, Page>& pages,
                                                      std::chrono::milliseconds patience = kPatience);
  /// Waits for the pages under way.
  ~Admin();

  /// The address with the port that was bound.
  const std::string& address() const;

 private:
  struct Impl;
  explicit Admin(std::unique_ptr<Impl> impl);
  const std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
