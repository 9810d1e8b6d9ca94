#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/gltf/accessors.h"

namespace lpdeform::gltf {

/// Elements of this many other layouts may lie between those of one. A stride of 252 bytes, the most that glTF allows, holds 63
/// elements of 4 bytes.
constexpr std::size_t kMostBetween = 64;

/// For each layout, all of one buffer, whether it shares no byte with another one. `share_bytes` says so of two; it is asked at
/// most kMostBetween times for each layout. A layout in whose reach more others begin counts as one that shares bytes, and so do
/// all layouts that begin there.
std::vector<bool> alone(const std::vector<Layout>& layouts,
                        const std::function<bool(const Layout&, const Layout&)>& share_bytes);

/// Whether elements of two layouts share bytes. Interleaved ones have one stride and different places within it.
bool share_bytes(const Layout& a, const Layout& b);

}  // namespace lpdeform::gltf
