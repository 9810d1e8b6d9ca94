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

/// A limit on bytes held. The server counts them itself: a caller reserves an estimate before it uses the
/// memory and corrects the amount once it is known. Thread-safe. Held by shared pointers.
class Budget : public std::enable_shared_from_this<Budget> {
 public:
  /// `most_bytes_each`: limit per owner; 0: without limit. It does not apply to the owner "", which stands
  /// for all anonymous callers.
  explicit Budget(std::size_t most_bytes, std::size_t most_bytes_each = 0)
      : most_(most_bytes), most_each_(most_bytes_each) {}

  /// RESOURCE_EXHAUSTED MEMORY_FULL if the budget has no room for this many bytes more, CALLER_MEMORY_FULL if
  /// the owner has none.
  absl::StatusOr<Reservation> reserve(std::size_t bytes, const std::string& owner = "");
  /// A reservation of no bytes, which can grow.
  Reservation nothing_yet(const std::string& owner = "");
  /// Whether this many bytes could be reserved now. Errors: as reserve().
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
  std::map<std::string, std::size_t> used_by_;  // only owners that hold some
};

/// A share of a budget, given back when this object is destroyed.
class Reservation {
 public:
  Reservation() = default;
  Reservation(Reservation&& other) noexcept;
  Reservation& operator=(Reservation&& other) noexcept;
  ~Reservation() { resize(0); }

  /// Grows to `bytes`; does nothing if the reservation is as large already. Errors: as Budget::reserve(), for
  /// the difference.
  absl::Status grow_to(std::size_t bytes);
  /// Corrects the amount, also beyond the limit: memory that is in use already must count.
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
