#pragma once

#include <grpcpp/grpcpp.h>

#include "lpdeform/v1/service.pb.h"

namespace lpdeform {

/// A message of a stream as it came. Of one that cannot be parsed (a text that is not UTF-8, say) gRPC says no more than of the
/// end of the stream; this way it is told apart, and its sender can be told.
template <typename Message>
struct Received {
  Message message;
  bool is_whole = false;  // it could be parsed
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
