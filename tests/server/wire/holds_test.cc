#include "server/wire/holds.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/one_of_each.h"

namespace lpdeform {
namespace {

TEST(WireHolds, EveryKindComesBackAsItWasWithANameOfItsOwn) {
  std::set<int> names;
  for (const Hold& hold : one_of_each<Hold>()) {
    v1::Handle message;
    encode_hold(hold, message);
    EXPECT_EQ(decode_hold(message), hold) << hold.index();
    EXPECT_NE(kind_of(hold), v1::HANDLE_KIND_UNSPECIFIED);
    EXPECT_TRUE(names.insert(kind_of(hold)).second) << hold.index();
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(v1::HandleKind_descriptor()->value_count()) - 1);
  EXPECT_EQ(names.size(),
            static_cast<std::size_t>(v1::Handle::descriptor()->FindOneofByName("hold")->field_count()) + 1);
}

TEST(WireHolds, AWeightThatIsLeftOutTakesItsDefaultAndZeroIsAWeight) {
  v1::Handle message;
  message.mutable_orientation();
  EXPECT_EQ(decode_hold(message), Hold(Orientation{100}));
  message.mutable_orientation()->set_weight(0);
  EXPECT_EQ(decode_hold(message), Hold(Orientation{0}));
}

}  // namespace
}  // namespace lpdeform
