#pragma once

#include <grpcpp/grpcpp.h>

#include "lpdeform/v1/service.pb.h"

namespace lpdeform {

/// A received message of a stream. If a message cannot be parsed (a text that is not UTF-8, for example),
/// gRPC reports it like the end of the stream. With this type the two differ, and the sender can be told.
template <typename Message>
struct Received {
  Message message;
  bool is_whole = false;  // whether it could be parsed
};

}  // namespace lpdeform

namespace grpc {

template <typename Message>
class SerializationTraits<lpdeform::Received<Message>> {
 public:
  static Status Deserialize(ByteBuffer* bytes, lpdeform::Received<Message>* out) {
    out->is_whole = SerializationTraits<Message>::Deserialize(bytes, &out->message).ok();
    return Status::OK;
  }
};

}  // namespace grpc
