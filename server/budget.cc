#include "server/budget.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"

namespace lpdeform {

absl::StatusOr<Reservation> Budget::reserve(std::size_t bytes) {
  const std::scoped_lock lock(mutex_);
  if (bytes > most_ || used_ > most_ - bytes) {
    return make_fault(absl::StatusCode::kResourceExhausted,
                      {"MEMORY_FULL", "memory", absl::StrCat("bytes <= ", most_)},
                      absl::StrCat("This needs about ", bytes, " bytes; the server has ", used_, " of its ",
                                   most_, " in use. Try again later, or with a smaller mesh."));
  }
  used_ += bytes;
  return Reservation(shared_from_this(), bytes);
}

std::size_t Budget::used() const {
  const std::scoped_lock lock(mutex_);
  return used_;
}

void Budget::change(std::size_t from, std::size_t to) {
  const std::scoped_lock lock(mutex_);
  used_ = used_ - from + to;
}

Reservation::Reservation(Reservation&& other) noexcept
    : budget_(std::move(other.budget_)), bytes_(std::exchange(other.bytes_, 0)) {}

Reservation& Reservation::operator=(Reservation&& other) noexcept {
  if (this == &other) return *this;
  resize(0);
  budget_ = std::move(other.budget_);
  bytes_ = std::exchange(other.bytes_, 0);
  return *this;
}

void Reservation::resize(std::size_t bytes) {
  if (budget_ == nullptr) return;
  budget_->change(bytes_, bytes);
  bytes_ = bytes;
}

}  // namespace lpdeform
