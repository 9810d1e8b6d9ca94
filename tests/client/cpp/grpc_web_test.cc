// How answers of gRPC-Web are read.

#include "client/cpp/grpc_web/grpc_web.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

std::string trailers(const std::string& block) {
  std::string frame = framed(block);
  frame[0] = '\x80';
  return frame;
}

/// Reads `body` in pieces of `piece` bytes.
std::vector<std::string> read(AnswerReader& reader, const std::string& body, std::size_t piece) {
  EXPECT_TRUE(reader.header(":status", "200").ok());
  EXPECT_TRUE(reader.header("content-type", "application/grpc-web+proto").ok());
  std::vector<std::string> messages;
  for (std::size_t k = 0; k < body.size(); k += piece) {
    const absl::Status read = reader.bytes(std::string_view(body).substr(k, piece), [&](std::string message) {
      messages.push_back(std::move(message));
    });
    EXPECT_TRUE(read.ok()) << read;
  }
  return messages;
}

TEST(GrpcWeb, ReadsMessagesAndTheStatusHoweverTheyAreCut) {
  const std::string long_one(70'000, 'x');
  const std::string body = framed("one") + framed("") + framed(long_one) + trailers("grpc-status: 0\r\n");
  for (const std::size_t piece :
       {std::size_t{1}, std::size_t{2}, std::size_t{7}, std::size_t{16'384}, body.size()}) {
    AnswerReader reader;
    EXPECT_EQ(read(reader, body, piece), (std::vector<std::string>{"one", "", long_one}));
    EXPECT_TRUE(reader.status().ok()) << reader.status();
  }
}

TEST(GrpcWeb, ReadsTheFaultOfTheDetails) {
  // google.rpc.Status with an ErrorInfo {reason: "P_OUT_OF_RANGE", metadata: {element: "p"}}, as grpc-status-details-bin.
  AnswerReader reader;
  read(reader,
       trailers("Grpc-Status: 3\r\ngrpc-message: p = 0%2C5 is wrong: %C3%A9\r\ngrpc-status-details-bin: "
                "GkoKKHR5cGUuZ29vZ2xlYXBpcy5jb20vZ29vZ2xlLnJwYy5FcnJvckluZm8SHgoOUF9PVVRfT0ZfUkFO"
                "R0UaDAoHZWxlbWVudBIBcA\r\n"),
       5);
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(reader.status().message(), "p = 0,5 is wrong: \xc3\xa9");
  EXPECT_EQ(fault_of(reader.status()), (Fault{"P_OUT_OF_RANGE", "p", ""}));
}

TEST(GrpcWeb, TakesTheStatusFromTheHeadersIfThereIsNoBody) {
  AnswerReader reader;
  EXPECT_TRUE(reader.header(":status", "200").ok());
  EXPECT_TRUE(reader.header("content-type", "application/grpc-web+proto").ok());
  EXPECT_TRUE(reader.header("grpc-status", "14").ok());
  EXPECT_TRUE(reader.header("grpc-message", "no healthy upstream").ok());
  EXPECT_EQ(reader.status(), absl::UnavailableError("no healthy upstream"));
}

TEST(GrpcWeb, AnAnswerWithoutItsEndIsUnavailable) {
  AnswerReader reader;
  read(reader, framed("one") + trailers("grpc-status: 0\r\n").substr(0, 9), 3);
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kUnavailable);
}

TEST(GrpcWeb, APageIsNoAnswerAndItsBytesAreNotRead) {
  AnswerReader reader;
  EXPECT_TRUE(reader.header(":status", "200").ok());
  EXPECT_TRUE(reader.header("content-type", "text/html").ok());
  EXPECT_TRUE(reader.bytes("\xff\xff\xff\xff\xff", [](std::string) { FAIL(); }).ok());
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_TRUE(reader.header(":status", "503").ok());
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(reader.header(":status", "401").ok());
  EXPECT_EQ(reader.status().code(), absl::StatusCode::kUnauthenticated);
}

TEST(GrpcWeb, RefusesWhatIsTooLongOrCompressed) {
  const auto refused_with = [](const std::string& start) {
    AnswerReader reader;
    EXPECT_TRUE(reader.header(":status", "200").ok());
    EXPECT_TRUE(reader.header("content-type", "application/grpc-web+proto").ok());
    return reader.bytes(start, [](std::string) { FAIL(); }).code();
  };
  EXPECT_EQ(refused_with(std::string("\0\x00\x40\x00\x01", 5)), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused_with(std::string("\0\xff\xff\xff\xff", 5)), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused_with(std::string("\x80\xff\xff\xff\xff", 5)), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused_with(std::string("\x80\x00\x01\x00\x01", 5)), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused_with(std::string("\x01\0\0\0\0", 5)), absl::StatusCode::kUnimplemented);
}

TEST(GrpcWeb, RefusesHeadersWithoutEnd) {
  AnswerReader reader;
  absl::Status read;
  std::size_t count = 0;
  for (; read.ok() && count < 100'000; ++count) read = reader.header("x-" + std::to_string(count), "value");
  EXPECT_EQ(read.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_LT(count, AnswerReader::kMostHeaderBytes / 8);
}

TEST(GrpcWeb, RefusesWhatComesAfterTheTrailers) {
  const std::string end = trailers("grpc-status: 0\r\n");
  for (const std::string& more : {framed("two"), end, std::string("x")}) {
    for (const std::size_t piece : {std::size_t{1}, std::size_t{1000}}) {
      AnswerReader reader;
      EXPECT_TRUE(reader.header(":status", "200").ok());
      EXPECT_TRUE(reader.header("content-type", "application/grpc-web+proto").ok());
      std::vector<std::string> messages;
      absl::Status status;
      const std::string body = framed("one") + end + more;
      for (std::size_t k = 0; k < body.size() && status.ok(); k += piece) {
        status = reader.bytes(std::string_view(body).substr(k, piece),
                              [&](std::string message) { messages.push_back(std::move(message)); });
      }
      EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
      EXPECT_EQ(messages, std::vector<std::string>{"one"});
    }
  }
}

TEST(GrpcWeb, TrailersDoNotChangeTheTypeOfTheAnswer) {
  AnswerReader reader;
  read(reader, trailers("content-type: text/html\r\ngrpc-status: 0\r\n"), 1);
  EXPECT_TRUE(reader.is_grpc_web());
  EXPECT_TRUE(reader.status().ok());
}

TEST(GrpcWeb, ACodeThatDoesNotExistIsUnknown) {
  for (const char* code : {"17", "-1", "99999"}) {
    AnswerReader reader;
    EXPECT_TRUE(reader.header(":status", "200").ok());
    EXPECT_TRUE(reader.header("grpc-status", code).ok());
    EXPECT_EQ(reader.status().code(), absl::StatusCode::kUnknown) << code;
  }
}

}  // namespace
}  // namespace lpdeform::client
