#pragma once

#include <chrono>
#include <memory>

#include "client/cpp/grpc_web/web_calls.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {

/// A Deform call made of calls that gRPC-Web has: frames come by StreamFrames; each update is an UpdateHandles, and
/// each acknowledgement an AckFrames. What it promises is that of DeformCall, with these differences:
/// - Updates under way may overtake each other: write() the next only as Rpc::order() allows. Their answers come in the
///   order of writing.
/// - A writer that another one has replaced learns it from the next frame or update, not at once. The call then ends with
///   NOT_THE_WRITER.
/// - An update of a lost session ends the call with that error.
std::unique_ptr<DeformCall> deform_by_web(std::shared_ptr<Http> http, Caller caller,
                                          std::chrono::milliseconds call_timeout);

}  // namespace lpdeform::client
