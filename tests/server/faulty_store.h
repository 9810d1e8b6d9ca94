#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

#include "server/store.h"

namespace lpdeform {

/// A store that a test makes fail or hang.
class FaultyStore final : public Store {
 public:
  explicit FaultyStore(std::shared_ptr<Store> store) : store_(std::move(store)) {}

  void set_failing(bool is_failing) {
    const std::scoped_lock lock(mutex_);
    is_failing_ = is_failing;
  }
  /// Whoever calls waits until it is over.
  void set_hanging(bool is_hanging) {
    {
      const std::scoped_lock lock(mutex_);
      is_hanging_ = is_hanging;
    }
    changed_.notify_all();
  }

  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->commit(changes);
  }
  absl::StatusOr<StoredSession> take_over(const std::string& session, const std::string& owner,
                                          const std::string& route) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->take_over(session, owner, route);
  }
  absl::StatusOr<std::string> find_request(const std::string& owner, const std::string& request_id) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->find_request(owner, request_id);
  }
  absl::StatusOr<std::vector<std::string>> list(const std::string& owner, const std::string& after,
                                                std::size_t most) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->list(owner, after, most);
  }
  absl::Status keep_blob(const std::string& session, const std::string& key,
                         std::string_view bytes) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->keep_blob(session, key, bytes);
  }
  absl::StatusOr<std::string> blob(const std::string& key) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->blob(key);
  }
  absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->touch(sessions);
  }
  absl::Status let_go(const std::vector<HeldSession>& sessions) override { return store_->let_go(sessions); }
  absl::StatusOr<std::size_t> remove_unused(std::int64_t idle_ms) override {
    if (absl::Status status = pass(); !status.ok()) return status;
    return store_->remove_unused(idle_ms);
  }

 private:
  absl::Status pass() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !is_hanging_; });
    return is_failing_ ? store_failing("a test wants it to") : absl::OkStatus();
  }

  const std::shared_ptr<Store> store_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_failing_ = false, is_hanging_ = false;
};

}  // namespace lpdeform
