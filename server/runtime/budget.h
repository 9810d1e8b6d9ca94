#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/status/statusor.h"

namespace lpdeform {

class Reservation;

/// Bytes that may be held, counted by us because nothing else does: asked for by estimate before they are
/// used, corrected when it is known. Thread-safe. Held by shared pointers.
class Budget : public std::enable_shared_from_this<Budget> {
 public:
  /// `most_bytes_each`: of one owner; 0: without limit. Not for the owner "", who is everybody.
  explicit Budget(std::size_t most_bytes, std::size_t most_bytes_each = 0)
      : most_(most_bytes), most_each_(most_bytes_each) {}

  /// RESOURCE_EXHAUSTED MEMORY_FULL where there is no room for so many more, CALLER_MEMORY_FULL where the owner has none.
  absl::StatusOr<Reservation> reserve(std::size_t bytes, const std::string& owner = "");
  /// A share of no bytes, which grows.
  Reservation nothing_yet(const std::string& owner = "");
  /// Whether so many could be reserved now. Errors: as reserve.
  absl::Status check(std::size_t bytes, const std::string& owner = "") const;

  std::size_t most() const { return most_; }
  std::size_t used() const;

 private:
  friend class Reservation;
  absl::Status check_locked(std::size_t bytes, const std::string& owner) const;
  void change(const std::string& owner, std::size_t from, std::size_t to);
  void change_locked(const std::string& owner, std::size_t from, std::size_t to);

  const std::size_t most_, most_each_;
  mutable std::mutex mutex_;
  std::size_t used_ = 0;
  std::map<std::string, std::size_t> used_by_;  // the owners that have any
};

/// A share of a budget, given back when it goes.
class Reservation {
 public:
  Reservation() = default;
  Reservation(Reservation&& other) noexcept;
  Reservation& operator=(Reservation&& other) noexcept;
  ~Reservation() { resize(0); }

  /// Errors: as Budget::reserve, for what is more than now; nothing where that is enough.
  absl::Status grow_to(std::size_t bytes);
  /// Corrects it, also beyond the limit: what is there is there.
  void resize(std::size_t bytes);
  std::size_t bytes() const { return bytes_; }

 private:
  friend class Budget;
  Reservation(std::shared_ptr<Budget> budget, std::string owner, std::size_t bytes)
      : budget_(std::move(budget)), owner_(std::move(owner)), bytes_(bytes) {}

  std::shared_ptr<Budget> budget_;
  std::string owner_;
  std::size_t bytes_ = 0;
};

}  // namespace lpdeform
