#pragma once

#include <lpdeform_follower.h>

#include <cstdint>
#include <memory>
#include <string>

#include "godot.h"

/// The class LpdeformSession of Godot's scripts: an LpdeformFollower that open() makes. Nothing here waits for the network, except
/// take_better_shape() and the end of the object (see LpdeformFollower). Functions that return a text return "" where nothing is wrong. Before open(), and where it failed, the others return false, or nothing.
class Session {
 public:
  /// Begins a session of the mesh. `positions` in Godot's coordinates; `normals` as many, or none; three `indices` per triangle,
  /// clockwise seen from outside. Returns what is wrong.
  std::string open(const std::string& address, const std::string& token, bool tls,
                   const godot::Vectors& positions, const godot::Vectors& normals,
                   const godot::Numbers& indices);
  /// Adds or replaces a handle of these vertices. False: problem() says why.
  bool hold(const std::string& name, const godot::Numbers& vertices);
  /// Removes a handle.
  bool let_go(const std::string& name);
  /// Takes each vertex x of the handle at rest to rotation x + translation.
  bool move(const std::string& name, const godot::Quaternion& rotation, const godot::Vector3& translation);
  /// See LpdeformFollower::set and LpdeformSearch.
  bool set_p(double p, bool shows_better, std::int64_t effort, double least_share);
  /// See LpdeformFollower::take_better_shape.
  bool take_better_shape();
  /// Once per picture. True if positions(), normals() and colours() are new.
  bool tick();

  godot::Vectors positions();
  godot::Vectors normals();
  godot::Colours colours();

  /// The last thing that went wrong, once.
  std::string problem();
  /// Why the server cannot be reached for now.
  std::string trouble();
  /// What the server says about itself or about the mesh, once when it changes.
  std::string notice();
  /// "connecting", "live", "reconnecting" or "refused"; "closed" before open().
  std::string state();
  /// True if the session has ended; problem() then says why.
  bool is_over();

 private:
  std::unique_ptr<LpdeformFollower> follower_;
};
