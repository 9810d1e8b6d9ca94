#include "server/runtime/upload.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/random_name.h"
#include "server/runtime/refusals.h"

namespace lpdeform {

absl::Status check_request_id(const std::string& request_id) {
  if (request_id.empty() || (request_id.size() >= kLeastRequestId && request_id.size() <= kMostRequestId))
    return absl::OkStatus();
  const std::string limit = absl::StrCat(kLeastRequestId, " to ", kMostRequestId);
  return make_fault(
      {Reason::kRequestId, "request_id", absl::StrCat("empty, or ", limit, " bytes")},
      absl::StrCat("The request_id has ", request_id.size(), " bytes; it may be empty or have ", limit, "."));
}

Upload::Upload(std::string name, std::uint64_t size_bytes, std::uint32_t crc32c, Reservation memory,
               std::string owner)
    : name_(std::move(name)),
      crc32c_(crc32c),
      owner_(std::move(owner)),
      memory_(std::move(memory)),
      bytes_(size_bytes) {}

absl::StatusOr<UploadProgress> Upload::add(std::uint64_t offset, std::string_view data) {
  if (absl::Status status = check_part(offset, data); !status.ok()) return status;
  const std::scoped_lock lock(mutex_);
  if (is_finished_) return UploadProgress{size(), true};
  if (bytes_.runs() >= kMostRuns && !bytes_.joins_a_run(offset, offset + data.size())) {
    return make_fault({Reason::kUploadScattered, name_, absl::StrCat("runs <= ", kMostRuns)},
                      absl::StrCat("The bytes received form ", kMostRuns,
                                   " runs with gaps between them; send a part that joins one of them."));
  }
  if (absl::Status status = put(offset, data); !status.ok()) return status;
  if (bytes_.received() < size()) return UploadProgress{bytes_.received(), false};
  return finish();
}

absl::Status Upload::check_part(std::uint64_t offset, std::string_view data) const {
  if (data.empty() || data.size() > kMostPartBytes) {
    return make_fault({Reason::kUploadPartSize, name_, absl::StrCat("1 to ", kMostPartBytes, " bytes")},
                      absl::StrCat("The part has ", data.size(), " bytes, not 1 to ", kMostPartBytes, "."));
  }
  if (offset <= size() && data.size() <= size() - offset) return absl::OkStatus();
  return make_fault({Reason::kUploadPartOutOfRange, name_, absl::StrCat("offset + size <= ", size())},
                    absl::StrCat("The part of ", data.size(), " bytes at ", offset,
                                 " does not lie within the upload's ", size(), " bytes."));
}

absl::Status Upload::put(std::uint64_t offset, std::string_view data) {
  absl::Status status = memory_.grow_to(bytes_.memory_with(offset, data.size()));
  if (!status.ok()) return status;
  const bool is_put = bytes_.put(offset, data);
  memory_.resize(bytes_.memory());
  is_empty_ = bytes_.received() == 0;
  if (is_put) return absl::OkStatus();
  return make_fault(
      {Reason::kMemoryFull, name_, ""},
      absl::StrCat("The machine has no memory for an upload of ", size(), " bytes; try again later."));
}

absl::StatusOr<UploadProgress> Upload::finish() {
  is_finished_ = lpdeform::crc32c(bytes_.whole()) == crc32c_;
  if (is_finished_) return UploadProgress{size(), true};
  bytes_.clear();
  is_empty_ = true;
  memory_.resize(0);
  return make_fault({Reason::kUploadChecksum, name_, ""},
                    "The bytes received do not have the announced checksum; send all of them again.");
}

absl::StatusOr<std::string_view> Upload::bytes() const {
  const std::scoped_lock lock(mutex_);
  if (is_finished_) return bytes_.whole();
  return make_fault({Reason::kUploadUnfinished, name_, absl::StrCat(size(), " bytes")},
                    absl::StrCat("The upload has ", bytes_.received(), " of its ", size(), " bytes."));
}

absl::Status request_id_reused() {
  return make_fault({Reason::kRequestIdReused, "request_id", ""},
                    "The request_id was used before, with another request.");
}

Uploads::Uploads(std::shared_ptr<Budget> budget, std::shared_ptr<Timers> timers, Limits limits)
    : budget_(std::move(budget)), timers_(std::move(timers)), limits_(limits) {}

absl::StatusOr<std::shared_ptr<Upload>> Uploads::create(const std::string& request_id,
                                                        std::uint64_t size_bytes, std::uint32_t crc32c,
                                                        const std::string& owner) {
  if (absl::Status status = check_request_id(request_id); !status.ok()) return status;
  if (size_bytes == 0 || size_bytes > limits_.most_bytes_each) {
    return make_fault({Reason::kUploadSize, "size_bytes", absl::StrCat("1 to ", limits_.most_bytes_each)},
                      absl::StrCat("An upload of ", size_bytes, " bytes is not within 1 to ",
                                   limits_.most_bytes_each, "."));
  }
  const std::scoped_lock lock(mutex_);
  if (const auto known = requested_.find({owner, request_id}); known != requested_.end()) {
    const std::shared_ptr<Upload>& upload = uploads_[known->second].upload;
    if (upload->size() == size_bytes && upload->crc32c() == crc32c) return upload;
    return request_id_reused();
  }
  if (absl::Status status = check_share(owner); !status.ok()) return status;
  if (absl::Status status = budget_->check(size_bytes, owner); !status.ok())
    return status;  // as if all its bytes came now
  if (absl::Status status = make_place(); !status.ok()) return status;
  auto upload = std::make_shared<Upload>(absl::StrCat("uploads/", random_hex_128()), size_bytes, crc32c,
                                         budget_->nothing_yet(owner), owner);
  const Timers::TimePoint now = timers_->now();
  uploads_[upload->name()] = {upload, request_id, now, now};
  if (!request_id.empty()) requested_[{owner, request_id}] = upload->name();
  ++owned_[owner];
  watch(now + limits_.idle);
  return upload;
}

/// Whether the owner may have one more.
absl::Status Uploads::check_share(const std::string& owner) const {
  const auto found = owned_.find(owner);
  const std::size_t theirs = found == owned_.end() ? 0 : found->second;
  if (owner.empty() || limits_.most_uploads_each == 0 || theirs < limits_.most_uploads_each)
    return absl::OkStatus();
  return make_fault(
      {Reason::kCallerUploadsFull, "uploads", absl::StrCat("uploads <= ", limits_.most_uploads_each)},
      absl::StrCat("The caller has all of the ", limits_.most_uploads_each,
                   " uploads that one caller may have; delete those that you no longer need."));
}

/// If no place is free, forgets an upload without bytes. Searches all uploads only when that may help, so
/// that a flood of calls stays cheap.
absl::Status Uploads::make_place() {
  if (uploads_.size() < limits_.most_uploads) return absl::OkStatus();
  const Timers::TimePoint now = timers_->now();
  if (now >= no_place_before_) {
    no_place_before_ = now + kEmptyPatience;
    auto longest_untouched = uploads_.end();
    for (auto entry = uploads_.begin(); entry != uploads_.end(); ++entry) {
      if (!entry->second.upload->is_empty()) continue;
      const Timers::TimePoint old_enough = entry->second.created + kEmptyPatience;
      no_place_before_ = std::min(no_place_before_, old_enough);
      if (old_enough > now) continue;
      if (longest_untouched == uploads_.end() ||
          entry->second.last_used < longest_untouched->second.last_used) {
        longest_untouched = entry;
      }
    }
    if (longest_untouched != uploads_.end()) {
      forget(longest_untouched);
      return absl::OkStatus();
    }
  }
  return retry_after(
      make_fault({Reason::kUploadsFull, "uploads", absl::StrCat("uploads <= ", limits_.most_uploads)},
                 absl::StrCat("The server has all of its ", limits_.most_uploads,
                              " uploads in use; delete those that you no longer need, or try again later.")),
      no_place_before_ - now);
}

absl::StatusOr<std::shared_ptr<Upload>> Uploads::find(const std::string& name, const std::string& owner) {
  const std::scoped_lock lock(mutex_);
  const auto found = uploads_.find(name);
  if (found != uploads_.end() && found->second.upload->owner() == owner) {
    found->second.last_used = timers_->now();
    return found->second.upload;
  }
  return make_fault({Reason::kUploadUnknown, "upload", ""}, "There is no such upload; it may have expired.");
}

void Uploads::remove(const std::string& name, const std::string& owner) {
  const std::scoped_lock lock(mutex_);
  const auto found = uploads_.find(name);
  if (found != uploads_.end() && found->second.upload->owner() == owner) forget(found);
}

std::size_t Uploads::size() const {
  const std::scoped_lock lock(mutex_);
  return uploads_.size();
}

void Uploads::forget(std::map<std::string, Entry>::iterator entry) {
  const std::string& owner = entry->second.upload->owner();
  requested_.erase({owner, entry->second.request_id});
  if (const auto owned = owned_.find(owner); --owned->second == 0) owned_.erase(owned);
  uploads_.erase(entry);
}

/// Sets one alarm for all uploads, however many there are.
void Uploads::watch(Timers::TimePoint when) {
  if (std::exchange(is_watching_, true)) return;
  timers_->at(when, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->expire();
  });
}

/// Forgets the uploads that have been idle for too long, and sets the alarm for the next one.
void Uploads::expire() {
  const std::scoped_lock lock(mutex_);
  is_watching_ = false;
  const Timers::TimePoint now = timers_->now();
  Timers::TimePoint next = Timers::TimePoint::max();
  for (auto entry = uploads_.begin(); entry != uploads_.end();) {
    const auto here = entry++;
    const Timers::TimePoint due = here->second.last_used + limits_.idle;
    if (due <= now) {
      forget(here);
    } else {
      next = std::min(next, due);
    }
  }
  if (!uploads_.empty()) watch(next);
}

}  // namespace lpdeform
