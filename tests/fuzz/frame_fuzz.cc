// libFuzzer: how a client handles parts of frames, in every encoding. The input is a sequence of DeformResponses, each preceded
// by its length in two bytes.

#include <algorithm>
#include <cstdint>

#include "client/cpp/frame_assembly.h"
#include "core/base/check.h"
#include "lpdeform/v1/service.pb.h"

namespace {

constexpr std::uint32_t kVertices = 22;

void check_sizes(const lpdeform::client::Frame& frame) {
  LPDEFORM_CHECK(frame.positions.size() == 3 * kVertices);
  LPDEFORM_CHECK(frame.distortion.empty() || frame.distortion.size() == kVertices);
  LPDEFORM_CHECK(frame.normals.empty() || frame.normals.size() == 3 * kVertices);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lpdeform;
  client::FrameAssembly assembly(kVertices);
  while (size >= 2) {
    const std::size_t length = std::min<std::size_t>(data[0] + 256u * data[1], size - 2);
    v1::DeformResponse response;
    if (response.ParseFromArray(data + 2, static_cast<int>(length)) && response.event().has_frame()) {
      const auto frame = assembly.add(response.event().frame());
      if (frame.ok() && *frame) check_sizes(**frame);
    }
    data += 2 + length;
    size -= 2 + length;
  }
  return 0;
}
