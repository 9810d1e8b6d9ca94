#include "server/wire/grpc_status.h"

#include <fstream>
#include <string>

#include "core/base/fault.h"
#include "service_fixture.h"

namespace lpdeform {
namespace {

std::string type_of(const std::string& reason) {
  const auto details = details_of(to_grpc(carry_fault(absl::StatusCode::kNotFound, {reason, "x", ""}, "")));
  return details.resource ? details.resource->resource_type() : "";
}

TEST(GrpcStatus, SaysWhatKindOfThingIsNotThere) {
  EXPECT_EQ(type_of("SESSION_UNKNOWN"), "lpdeform.v1.Session");
  EXPECT_EQ(type_of("SESSION_DAMAGED"), "lpdeform.v1.Session");
  EXPECT_EQ(type_of("UPLOAD_UNKNOWN"), "lpdeform.v1.Upload");
  EXPECT_EQ(type_of("HANDLE_UNKNOWN"), "lpdeform.v1.Handle");
  EXPECT_EQ(type_of("STREAM_UNKNOWN"), "lpdeform.v1.Stream");
}

TEST(GrpcStatus, KnowsTheKindForEachReasonOfTheContract) {
  std::ifstream errors(LPDEFORM_ERRORS_MD);
  int found = 0;
  for (std::string line; std::getline(errors, line) && line != "## From the client libraries";) {
    if (line.find("| NOT_FOUND |") == std::string::npos) continue;
    const std::string reason = line.substr(3, line.find('`', 3) - 3);
    EXPECT_TRUE(type_of(reason).starts_with("lpdeform.v1.")) << reason;
    ++found;
  }
  EXPECT_GE(found, 5);
}

}  // namespace
}  // namespace lpdeform
