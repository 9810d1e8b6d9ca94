#include "session.h"

#include <algorithm>
#include <limits>

std::string Session::open(const std::string& address, const std::string& token, bool tls,
                          const godot::Vectors& positions, const godot::Vectors& normals,
                          const godot::Numbers& indices) {
  follower_.reset();
  if (!normals.empty() && normals.size() != positions.size())
    return "there are " + std::to_string(normals.size() / 3) + " normals for " +
           std::to_string(positions.size() / 3) + " vertices";
  try {
    follower_ = std::make_unique<LpdeformFollower>(LpdeformServer{address, token, tls}, kGodotSpace,
                                                   LpdeformShape{positions, normals, indices});
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

bool Session::hold(const std::string& name, const godot::Numbers& vertices) {
  return follower_ && follower_->hold(name, vertices);
}

bool Session::let_go(const std::string& name) {
  return follower_ && follower_->let_go(name);
}

bool Session::move(const std::string& name, const godot::Quaternion& rotation,
                   const godot::Vector3& translation) {
  double turn[4], shift[3];
  std::copy(rotation.begin(), rotation.end(), turn);
  std::copy(translation.begin(), translation.end(), shift);
  return follower_ && follower_->move(name.c_str(), turn, shift);
}

bool Session::set_p(double p, bool shows_better, std::int64_t effort, double least_share) {
  constexpr std::int64_t kMost = std::numeric_limits<int>::max();
  const int starts = static_cast<int>(std::clamp<std::int64_t>(effort, -1, kMost));
  return follower_ && follower_->set(p, {shows_better, starts, least_share});
}

bool Session::take_better_shape() {
  return follower_ && follower_->take_better_shape();
}

bool Session::tick() {
  return follower_ && follower_->tick();
}

godot::Vectors Session::positions() {
  return follower_ ? godot::Vectors{follower_->positions()} : godot::Vectors{};
}

godot::Vectors Session::normals() {
  return follower_ ? godot::Vectors{follower_->normals()} : godot::Vectors{};
}

godot::Colours Session::colours() {
  return follower_ ? godot::Colours{follower_->colours()} : godot::Colours{};
}

std::string Session::problem() {
  return follower_ ? follower_->problem() : "";
}

std::string Session::trouble() {
  return follower_ ? follower_->trouble() : "";
}

std::string Session::notice() {
  return follower_ ? follower_->notice() : "";
}

std::string Session::state() {
  if (!follower_) return "closed";
  switch (follower_->state()) {
    case LPDEFORM_STATE_CONNECTING:
      return "connecting";
    case LPDEFORM_STATE_LIVE:
      return "live";
    case LPDEFORM_STATE_RECONNECTING:
      return "reconnecting";
    default:
      return "refused";
  }
}

bool Session::is_over() {
  return follower_ && follower_->is_over();
}
