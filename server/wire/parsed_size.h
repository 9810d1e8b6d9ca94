#pragma once

#include <google/protobuf/descriptor.h>

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace lpdeform {

/// What a message's fields of type bytes are messages of in their turn, if they are: by the message and its bytes as they
/// stand there.
using InnerType = std::function<const google::protobuf::Descriptor*(const google::protobuf::Descriptor& type,
                                                                    std::string_view message)>;

/// About how many bytes of memory a message takes once it is parsed, found in its bytes without parsing them. Two bytes can
/// become a hundred, so whoever parses what a stranger made, of a size that gRPC does not bound, asks first. `bytes`: fewer than
/// 2^31.
std::size_t parsed_size(const google::protobuf::Descriptor& type, std::string_view bytes,
                        const InnerType& inner = nullptr);

}  // namespace lpdeform
