#include "server/runtime/budget.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {

absl::StatusOr<Reservation> Budget::reserve(std::size_t bytes, const std::string& owner) {
  const std::scoped_lock lock(mutex_);
  if (absl::Status status = check_locked(bytes, owner); !status.ok()) return status;
  change_locked(owner, 0, bytes);
  return Reservation(shared_from_this(), owner, bytes);
}

Reservation Budget::nothing_yet(const std::string& owner) {
  return Reservation(shared_from_this(), owner, 0);
}

absl::Status Budget::check(std::size_t bytes, const std::string& owner) const {
  const std::scoped_lock lock(mutex_);
  return check_locked(bytes, owner);
}

absl::Status Budget::check_locked(std::size_t bytes, const std::string& owner) const {
  if (bytes > most_ || used_ > most_ - bytes) {
    return make_fault({Reason::kMemoryFull, "memory", absl::StrCat("bytes <= ", most_)},
                      absl::StrCat("This needs about ", bytes, " bytes; the server has ", used_, " of its ",
                                   most_, " in use. Try again later, or with a smaller mesh."));
  }
  const auto found = used_by_.find(owner);
  const std::size_t theirs = found == used_by_.end() ? 0 : found->second;
  if (!owner.empty() && most_each_ != 0 && (bytes > most_each_ || theirs > most_each_ - bytes)) {
    return make_fault(
        {Reason::kCallerMemoryFull, "memory", absl::StrCat("bytes <= ", most_each_)},
        absl::StrCat("This needs about ", bytes, " bytes; the caller has ", theirs, " of the ", most_each_,
                     " that one caller may have in use. Delete a session or an upload first, or take a "
                     "smaller mesh."));
  }
  return absl::OkStatus();
}

std::size_t Budget::used() const {
  const std::scoped_lock lock(mutex_);
  return used_;
}

void Budget::change(const std::string& owner, std::size_t from, std::size_t to) {
  const std::scoped_lock lock(mutex_);
  change_locked(owner, from, to);
}

void Budget::change_locked(const std::string& owner, std::size_t from, std::size_t to) {
  used_ = used_ - from + to;
  if (owner.empty()) return;
  std::size_t& theirs = used_by_[owner];
  theirs = theirs - from + to;
  if (theirs == 0) used_by_.erase(owner);
}

Reservation::Reservation(Reservation&& other) noexcept
    : budget_(std::move(other.budget_)),
      owner_(std::move(other.owner_)),
      bytes_(std::exchange(other.bytes_, 0)) {}

Reservation& Reservation::operator=(Reservation&& other) noexcept {
  if (this == &other) return *this;
  resize(0);
  budget_ = std::move(other.budget_);
  owner_ = std::move(other.owner_);
  bytes_ = std::exchange(other.bytes_, 0);
  return *this;
}

absl::Status Reservation::grow_to(std::size_t bytes) {
  if (budget_ == nullptr || bytes <= bytes_) return absl::OkStatus();
  absl::StatusOr<Reservation> more = budget_->reserve(bytes - bytes_, owner_);
  if (!more.ok()) return more.status();
  bytes_ += std::exchange(more->bytes_, 0);
  return absl::OkStatus();
}

void Reservation::resize(std::size_t bytes) {
  if (budget_ == nullptr) return;
  budget_->change(owner_, bytes_, bytes);
  bytes_ = bytes;
}

}  // namespace lpdeform
