#pragma once

#include <cstdint>
#include <random>

#include <google/protobuf/message.h>

namespace lpdeform::fuzz {

/// Changes a message in one place of its tree: a number to an extreme of its range or near its old value, bytes and text by
/// libFuzzer, a field set or cleared, an element added, removed, duplicated or moved.
void mutate(google::protobuf::Message& message, std::mt19937& random);

}  // namespace lpdeform::fuzz
