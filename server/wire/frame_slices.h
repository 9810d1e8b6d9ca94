#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include <cstddef>
#include <vector>

#include "lpdeform/v1/service.pb.h"
#include "server/wire/outgoing.h"

namespace lpdeform {

/// A part of a frame in a message, without its numbers. The lengths around it do not include the numbers yet.
struct PartInMessage {
  const google::protobuf::MessageLite& message;
  struct Field {
    int number;
    std::size_t size;  // of its contents
  };
  std::vector<Field> path;  // from the message to the part, each the last field of the one before
};

inline PartInMessage part_in(const v1::SolveResponse& message) {
  return {message, {{v1::SolveResponse::kFrameFieldNumber, message.frame().ByteSizeLong()}}};
}
/// For a message with an event.
template <typename Message>
PartInMessage part_in(const Message& message) {
  return {message,
          {{Message::kEventFieldNumber, message.event().ByteSizeLong()},
           {v1::StreamEvent::kFrameFieldNumber, message.event().frame().ByteSizeLong()}}};
}

/// Size of the message with the numbers of `piece`.
std::size_t size_with(const PartInMessage& part, const FramePiece& piece);

/// Bytes of the message. The numbers stay in the piece's surface, which the slices keep alive. They begin at
/// multiples of 4 bytes in the message (8 for float64).
std::vector<grpc::Slice> slices_with(const PartInMessage& part, const FramePiece& piece);

template <typename Message>
std::size_t Outgoing<Message>::ByteSizeLong() const {
  return piece ? size_with(part_in(message), *piece) : message.ByteSizeLong();
}

}  // namespace lpdeform

namespace grpc {

template <typename Message>
class SerializationTraits<lpdeform::Outgoing<Message>> {
 public:
  static Status Serialize(const lpdeform::Outgoing<Message>& out, ByteBuffer* bytes, bool* is_ours) {
    if (!out.piece) return SerializationTraits<Message>::Serialize(out.message, bytes, is_ours);
    const std::vector<Slice> slices = lpdeform::slices_with(lpdeform::part_in(out.message), *out.piece);
    ByteBuffer whole(slices.data(), slices.size());
    bytes->Swap(&whole);
    *is_ours = true;
    return Status::OK;
  }
};

}  // namespace grpc
