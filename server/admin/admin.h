#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace lpdeform {

/// A few pages over plain HTTP for whoever runs the server: read only, without authentication, for private networks.
/// Answers GET and HEAD. On an address of this machine alone, to who calls it by a name of this machine: see names_this_machine().
/// Connections are waited for by one thread together, so no number of slow ones keeps another from its
/// page; and each page is made by a thread of its own, so no page keeps another from being made.
class Admin {
 public:
  struct Answer {
    int status = 200;
    std::string content_type;
    std::string body;
  };
  using Page = std::function<Answer()>;

  /// For a peer to send its whole request, and to take the whole answer.
  static constexpr std::chrono::milliseconds kPatience{5000};
  /// Of connections that wait for their peers; beyond that, the oldest of them is closed for a new one.
  static constexpr std::size_t kMostPatient = 128;

  /// `address`: HOST:PORT, port 0 for a free one; `pages` by their paths ("/metrics"). A page is made for all together who
  /// have asked for it while it was made the last time. Errors: UNAVAILABLE ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Admin>> start(const std::string& address,
                                                      const std::map<std::string, Page>& pages,
                                                      std::chrono::milliseconds patience = kPatience);
  /// Waits for the pages under way.
  ~Admin();

  /// With the port that was found.
  const std::string& address() const;

 private:
  struct Impl;
  explicit Admin(std::unique_ptr<Impl> impl);
  const std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
