#include "server/session/publisher.h"

#include <gtest/gtest.h>

namespace lpdeform {
namespace {

TEST(PublisherTest, NothingElseIsAnnouncedWhileAShapeIsTaken) {
  Publisher publisher;
  EXPECT_TRUE(publisher.announce({.input_seq = 7, .energy = 2}));
  ASSERT_TRUE(publisher.take_better(7));
  EXPECT_FALSE(publisher.announce({.input_seq = 7, .energy = 1}));
  ASSERT_TRUE(publisher.better());
  EXPECT_EQ(publisher.better()->energy, 2);
  EXPECT_EQ(publisher.better()->number, 1u);
  EXPECT_TRUE(publisher.forget_better());  // it was taken
  EXPECT_FALSE(publisher.better());

  EXPECT_TRUE(publisher.announce({.input_seq = 7, .energy = 1}));
  EXPECT_EQ(publisher.better()->energy, 1);
  EXPECT_EQ(publisher.better()->number, 2u);
  EXPECT_FALSE(publisher.forget_better());
}

TEST(PublisherTest, AShapeForAnotherInputIsNotTaken) {
  Publisher publisher;
  EXPECT_FALSE(publisher.take_better(7));
  EXPECT_TRUE(publisher.announce({.input_seq = 7}));
  EXPECT_FALSE(publisher.take_better(8));
  EXPECT_FALSE(publisher.is_better_taken());
  EXPECT_TRUE(publisher.take_better(7));
  EXPECT_TRUE(publisher.is_better_taken());
}

}  // namespace
}  // namespace lpdeform
