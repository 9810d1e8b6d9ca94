// The page and its verdicts, from figures made up here.

#include "client/cli/reproduce/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace lpdeform::reproduce {
namespace {

using testing::HasSubstr;
using testing::Not;

Figure figure(bool holds) {
  return {"figure_x",      "Figure X: a < b",
          "A shape.",      {{"It is said.", "It was 3.", holds, {{"three", 3.0}}}},
          "<p>body</p>",   {{"x.png", "L1", "bytes", 4, 3}},
          "A note & more."};
}

TEST(Page, SaysOfEachClaimWhetherItHolds) {
  EXPECT_THAT(page_html({figure(true)}, {}), HasSubstr("holds here</span>"));
  EXPECT_THAT(page_html({figure(true)}, {}), Not(HasSubstr("does not hold here")));
  EXPECT_THAT(page_html({figure(false)}, {}), HasSubstr("does not hold here</span>"));
}

TEST(Page, ShowsClaimNumberPictureBodyAndNote) {
  const std::string html = page_html({figure(true)}, {});
  for (const char* part :
       {"It is said.", "It was 3.", "src=\"x.png\"", "<p>body</p>", "A note &amp; more.", "a &lt; b"})
    EXPECT_THAT(html, HasSubstr(part));
}

TEST(Page, CountsTheClaimsThatHold) {
  EXPECT_THAT(page_html({figure(true), figure(false)}, {}), HasSubstr("1 of 2 claims hold here"));
}

TEST(Page, NeedsNoNetworkAndNoScript) {
  const std::string html = page_html({figure(true)}, {});
  for (const char* part : {"<script", "https://", "@import", "url(", "src=\"http", "href=\"http"})
    EXPECT_THAT(html, Not(HasSubstr(part)));
}

TEST(Verdicts, HoldWhatThePageSays) {
  Settings settings;
  settings.size = 0.5;
  const auto verdicts = nlohmann::json::parse(verdicts_json({figure(true), figure(false)}, settings));
  EXPECT_EQ(verdicts["made_by"], kMadeBy);
  EXPECT_EQ(verdicts["size"], 0.5);
  EXPECT_EQ(verdicts["claims"], 2);
  EXPECT_EQ(verdicts["claims_that_hold"], 1);
  const auto& first = verdicts["figures"][0];
  EXPECT_EQ(first["id"], "figure_x");
  EXPECT_EQ(first["pictures"], nlohmann::json::parse("[\"x.png\"]"));
  EXPECT_EQ(first["claims"][0]["numbers"]["three"], 3.0);
  EXPECT_EQ(first["claims"][0]["holds"], true);
}

TEST(Verdicts, NameTheirPicturesAndNothingOutsideOfTheirFolder) {
  using testing::ElementsAre;
  using testing::IsEmpty;
  EXPECT_THAT(pictures_named(verdicts_json({figure(true), figure(false)}, {})), ElementsAre("x.png"));
  EXPECT_THAT(pictures_named(R"({"figures": [{"pictures": ["../a.png", "/b.png", "c.txt", 4, "d.png"]}]})"),
              ElementsAre("d.png"));
  for (const char* text : {"", "{", "[]", "{\"figures\": 3}", R"({"figures": [3, {"pictures": {}}]})"})
    EXPECT_THAT(pictures_named(text), IsEmpty()) << text;
}

}  // namespace
}  // namespace lpdeform::reproduce
