#pragma once

#include <cstdint>
#include <random>

#include <google/protobuf/message.h>

namespace lpdeform::fuzz {

/// Changes a message in one place, somewhere in its tree: a number to one at an edge of its range or near to what it was, bytes
/// and text by libFuzzer, a field set or cleared, an element added, taken out, doubled or moved.
void mutate(google::protobuf::Message& message, std::mt19937& random);

}  // namespace lpdeform::fuzz
