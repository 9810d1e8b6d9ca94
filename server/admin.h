#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace lpdeform {

/// A few pages over plain HTTP for whoever runs the server: read only, without authentication, for private networks.
/// Answers GET and HEAD. On an address of this machine alone, to who calls it by a name of this machine: see names_this_machine().
class Admin {
 public:
  struct Answer {
    int status = 200;
    std::string content_type;
    std::string body;
  };
  using Page = std::function<Answer()>;

  /// `address`: HOST:PORT, port 0 for a free one; `pages` by their paths ("/metrics"). Pages are made on threads of
  /// their own, several at a time. Errors: UNAVAILABLE ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Admin>> start(const std::string& address,
                                                      const std::map<std::string, Page>& pages);
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
