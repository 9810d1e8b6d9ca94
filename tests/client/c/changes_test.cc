// Changes of handles as the C++ client takes them.

#include "client/c/changes.h"

#include <gtest/gtest.h>

#include <variant>

#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

lpdeform_handle handle_of(lpdeform_hold hold) {
  static constexpr std::uint32_t kVertices[] = {1, 2};
  lpdeform_handle handle{};
  handle.struct_size = sizeof(handle);
  handle.name = "tip";
  handle.vertices = kVertices;
  handle.vertex_count = 2;
  handle.hold = hold;
  handle.direction[0] = 1;
  return handle;
}

TEST(Changes, EveryNumberOfAHoldIsTheKindOfThatPlace) {
  const Space space = Space::of({}).value();
  constexpr std::size_t kKinds = std::variant_size_v<client::Hold>;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const auto read = read_handle(handle_of(static_cast<lpdeform_hold>(kind)), space);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->hold.index(), kind);
  }
  for (const lpdeform_hold wrong : {-1, static_cast<int>(kKinds), 1 << 30})
    EXPECT_EQ(fault_of(read_handle(handle_of(wrong), space).status()).reason, "ENUM_UNKNOWN");
}

TEST(Changes, AWeightOfZeroIsTheDefaultOfItsKind) {
  const Space space = Space::of({}).value();
  lpdeform_handle handle = handle_of(LPDEFORM_SOFT);
  EXPECT_EQ(std::get<client::Soft>(read_handle(handle, space)->hold).weight, 1);
  handle.hold = LPDEFORM_ORIENTATION;
  EXPECT_EQ(std::get<client::Orientation>(read_handle(handle, space)->hold).weight, 100);
  handle.weight = 7;
  EXPECT_EQ(std::get<client::Orientation>(read_handle(handle, space)->hold).weight, 7);
}

}  // namespace
}  // namespace lpdeform::engine
