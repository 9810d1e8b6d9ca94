// Uploads by the calls of the running service.

#include "core/base/crc32c.h"
#include "service_fixture.h"

namespace lpdeform {
namespace {

constexpr std::size_t kPart = 1 << 20;

class UploadCallsTest : public ServiceTest {
 protected:
  void SetUp() override {
    options_.max_bytes = kMost;
    start();
  }

  grpc::Status announce(const std::string& bytes, std::string& name) {
    grpc::ClientContext context;
    v1::CreateUploadRequest request;
    v1::CreateUploadResponse response;
    request.set_size_bytes(bytes.size());
    request.set_crc32c(crc32c(bytes));
    const grpc::Status status = stub_->CreateUpload(&context, request, &response);
    name = response.upload();
    return status;
  }
  grpc::Status send(const std::string& name, std::size_t offset, const std::string& data) {
    grpc::ClientContext context;
    v1::UploadPartRequest request;
    request.set_upload(name);
    request.set_offset(offset);
    request.set_data(data);
    return stub_->UploadPart(&context, request, &progress_);
  }
  void discard(const std::string& name) {
    grpc::ClientContext context;
    v1::DeleteUploadRequest request;
    v1::DeleteUploadResponse response;
    request.set_upload(name);
    EXPECT_TRUE(stub_->DeleteUpload(&context, request, &response).ok());
  }

  static constexpr std::size_t kMost = 8 << 20;
  v1::UploadPartResponse progress_;
};

TEST_F(UploadCallsTest, AnnouncedUploadsKeepNobodyOut) {
  const std::string bytes(kMost, 'x');
  std::vector<std::string> names(95);
  for (std::string& name : names) ASSERT_TRUE(announce(bytes, name).ok());
  create(bar_mesh());
  // Nor those of which the last byte alone has come.
  for (const std::string& name : names) ASSERT_TRUE(send(name, bytes.size() - 1, "x").ok());
}

TEST_F(UploadCallsTest, APartForWhichThereIsNoMemorySaysSoAndMayBeSentAgain) {
  const std::string bytes(5 * kPart, 'x'), part(kPart, 'x');
  std::string mine, others;
  ASSERT_TRUE(announce(bytes, mine).ok());
  ASSERT_TRUE(announce(bytes, others).ok());
  for (std::size_t k = 0; k < 4; ++k) ASSERT_TRUE(send(others, k * kPart, part).ok());
  for (std::size_t k = 0; k < 4; ++k) ASSERT_TRUE(send(mine, k * kPart, part).ok());
  const grpc::Status refused = send(mine, 4 * kPart, part);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  const ErrorDetails details = details_of(refused);
  EXPECT_EQ(details.info.reason(), "MEMORY_FULL");
  EXPECT_EQ(details.info.metadata().at("element"), "memory");
  EXPECT_EQ(details.info.metadata().at("limit"), "bytes <= 8388608");
  EXPECT_TRUE(details.retry && details.quota);
  discard(others);
  ASSERT_TRUE(send(mine, 4 * kPart, part).ok());
  EXPECT_TRUE(progress_.finished());
}

}  // namespace
}  // namespace lpdeform
