#pragma once

#include <google/protobuf/descriptor.h>

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace lpdeform {

/// The type of the messages that are stored in a message's fields of type bytes; null if they are not
/// messages. Arguments: the message's type and its bytes.
using InnerType = std::function<const google::protobuf::Descriptor*(const google::protobuf::Descriptor& type,
                                                                    std::string_view message)>;

/// An estimate of the memory that a message takes once it is parsed, from its bytes and without parsing them.
/// Two bytes can become a hundred, so code that parses untrusted data whose size gRPC does not limit must ask
/// first. `bytes`: fewer than 2^31.
std::size_t parsed_size(const google::protobuf::Descriptor& type, std::string_view bytes,
                        const InnerType& inner = nullptr);

}  // namespace lpdeform
