// The program lpdeform-server as an operator runs it.

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "lpdeform/v1/service.grpc.pb.h"
#include "program.h"
#include "server/admin/health_probe.h"
#include "server/flags.h"

namespace lpdeform {
namespace {

TEST(Program, PrintsItsAddressServesAndExitsCleanlyWhenStopped) {
  for (const int number : {SIGTERM, SIGINT}) {
    Program program({"--address", "127.0.0.1:0", "--grace", "5"});
    const std::string address = program.address();
    ASSERT_FALSE(address.empty());
    EXPECT_TRUE(is_serving(address));
    program.signal(number);
    EXPECT_EQ(program.wait(), 0);
  }
}

TEST(Program, LogsOneJsonObjectAnEvent) {
  Program program({"--address", "127.0.0.1:0"});
  ASSERT_FALSE(program.address().empty());
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  std::istringstream lines(program.rest());
  std::vector<std::string> events;
  for (std::string text; std::getline(lines, text);) {
    const auto event = nlohmann::json::parse(text);
    EXPECT_TRUE(event.contains("time"));
    EXPECT_EQ(event.at("level"), event.at("event") == "no_authentication" ? "warning" : "info");
    events.push_back(event.at("event"));
  }
  ASSERT_GE(events.size(), 2u);
  EXPECT_EQ(events.back(), "stopped");
}

/// A tetrahedron whose first vertex cannot be mistaken for anything else in a log.
v1::CreateSessionRequest tetrahedron() {
  const std::vector<double> points{31415.9265, 0, 0, 31416.9265, 0, 0, 31415.9265, 1, 0, 31415.9265, 0, 1};
  const std::vector<std::uint32_t> faces{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  v1::CreateSessionRequest request;
  request.mutable_mesh()->set_vertex_count(4);
  request.mutable_mesh()->set_face_count(4);
  request.mutable_mesh()->set_scalar(v1::SCALAR_FLOAT64);
  std::string data(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(double));
  data.append(reinterpret_cast<const char*>(faces.data()), faces.size() * sizeof(std::uint32_t));
  request.mutable_mesh()->mutable_data()->set_inline_(data);
  return request;
}

TEST(Program, LogsTellOfSessionEpochSequenceAndTraceAndNothingSecret) {
  Program program({"--address", "127.0.0.1:0", "--log-level", "debug"});
  const auto stub =
      v1::DeformService::NewStub(grpc::CreateChannel(program.address(), grpc::InsecureChannelCredentials()));
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  const auto traced = [&](grpc::ClientContext& context) {
    context.AddMetadata("traceparent", "00-" + trace + "-00f067aa0ba902b7-01");
  };
  grpc::ClientContext creating, updating, misplaced, refused;
  for (auto* context : {&creating, &updating, &misplaced, &refused}) traced(*context);
  v1::CreateSessionResponse session;
  ASSERT_TRUE(stub->CreateSession(&creating, tetrahedron(), &session).ok());
  v1::UpdateHandlesRequest update;
  update.set_session(session.session().name());
  update.set_writer_token(session.writer_token());
  update.mutable_update()->set_input_seq(17);
  update.mutable_update()->mutable_settings()->mutable_p()->set_uniform(1.5);
  v1::UpdateHandlesResponse taken;
  ASSERT_TRUE(stub->UpdateHandles(&updating, update, &taken).ok());
  // Refused in words that quote its numbers: to the caller, not to the log.
  const std::vector<double> weights{0.25, 27182.818, 0.5};
  v1::UpdateHandlesRequest off = update;
  v1::HandleUpdate& handle = *off.mutable_update()->add_handles();
  handle.set_name("off");
  handle.mutable_set()->mutable_points()->mutable_faces()->set_inline_(std::string(4, '\0'));
  handle.mutable_set()->mutable_points()->set_scalar(v1::SCALAR_FLOAT64);
  handle.mutable_set()->mutable_points()->mutable_barycentric()->set_inline_(weights.data(), 24);
  const grpc::Status told = stub->UpdateHandles(&misplaced, off, &taken);
  EXPECT_NE(told.error_message().find("27182.8"), std::string::npos) << told.error_message();
  update.set_writer_token("a token that is wrong");
  ASSERT_FALSE(stub->UpdateHandles(&refused, update, &taken).ok());
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);

  const std::string log = program.rest();
  std::map<std::string, nlohmann::json> events;
  std::istringstream lines(log);
  for (std::string text; std::getline(lines, text);) {
    const auto event = nlohmann::json::parse(text);
    events[event.at("event")] = event;
  }
  const std::string digits = session.session().name().substr(9, 8);
  EXPECT_EQ(events["session_created"]["session"], digits);
  EXPECT_EQ(events["session_created"]["epoch"], 1);
  EXPECT_EQ(events["update"]["session"], digits);
  EXPECT_EQ(events["update"]["input_seq"], 17);
  EXPECT_EQ(events["update"]["epoch"], 1);
  EXPECT_EQ(events["refused"]["reason"], "NOT_THE_WRITER");
  EXPECT_EQ(events["refused"]["method"], "lpdeform.v1.DeformService/UpdateHandles");
  EXPECT_EQ(events["refused"]["session"], digits);
  EXPECT_EQ(events["refused"]["epoch"], 1);
  EXPECT_EQ(events["refused"]["input_seq"], 17);
  for (const char* const event : {"session_created", "update", "refused"})
    EXPECT_EQ(events[event]["trace_id"], trace) << event;
  EXPECT_EQ(events["session_ended"]["reason"], "draining");
  for (const std::string& secret :
       {session.session().name().substr(9), session.writer_token(), std::string("a token that is wrong"),
        std::string("31415"), std::string("31416"), std::string("27182")}) {
    EXPECT_EQ(log.find(secret), std::string::npos) << secret;
  }
}

/// Bytes sent to a port of this machine; what comes back until the other side closes is thrown away.
void send_raw(const std::string& address, const std::string& bytes) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(static_cast<in_port_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&where), sizeof(where)), 0);
  ASSERT_EQ(send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  shutdown(fd, SHUT_WR);
  char thrown_away[4096];
  while (recv(fd, thrown_away, sizeof(thrown_away), 0) > 0) {
  }
  close(fd);
}

std::string http2_frame(char type, char flags, char stream, const std::string& payload) {
  const auto size = static_cast<char>(payload.size());
  return std::string{0, 0, size, type, flags, 0, 0, 0, stream} + payload;
}

TEST(Program, LogsWhatGrpcSaysOfItselfAsJsonAndWithoutWhatCallersSent) {
  Program program({"--address", "127.0.0.1:0", "--log-level", "debug"});
  const auto literal = [](const std::string& name, const std::string& value) {
    return std::string(1, '\0') + static_cast<char>(name.size()) + name + static_cast<char>(value.size()) +
           value;
  };
  // A value that a header "te" must not have: gRPC 1.51 says so on stderr, and quotes it.
  const std::string headers =
      "\x83\x86" + literal(":path", "/x/y") + literal(":authority", "x") + literal("te", "Bearer SECRET");
  send_raw(program.address(),
           "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + http2_frame(4, 0, 0, "") + http2_frame(1, 5, 1, headers));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  const std::string log = program.rest();
  EXPECT_EQ(log.find("SECRET"), std::string::npos) << log;
  bool has_grpc = false;
  std::istringstream lines(log);
  for (std::string text; std::getline(lines, text);) {
    const auto event = nlohmann::json::parse(text);
    if (event.at("event") != "grpc") continue;
    has_grpc = true;
    EXPECT_EQ(event.at("file"), "hpack_parser.cc");
  }
  EXPECT_TRUE(has_grpc) << log;
}

TEST(Program, TakesItsOptionsFromTheEnvironmentToo) {
  Program program({}, {"LPDEFORM_ADDRESS=127.0.0.1:0", "LPDEFORM_LOG_LEVEL=off"});
  const std::string address = program.address();
  ASSERT_FALSE(address.empty());
  EXPECT_FALSE(address.ends_with(":0"));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0);
  EXPECT_EQ(program.rest(), "");
}

TEST(Program, HelpNamesEveryOptionsVariable) {
  Program program({"--help"});
  const std::string help = program.rest();
  EXPECT_EQ(program.wait(), 0);
  Arguments arguments;
  for (const Flag& flag : flags_of(arguments)) {
    EXPECT_NE(help.find(absl::StrCat("  --", flag.name)), std::string::npos) << flag.name;
    if (!flag.is_in_environment) continue;
    EXPECT_NE(help.find(environment_variable(flag) + ")"), std::string::npos) << flag.name;
  }
}

TEST(Program, RefusesWrongOptionsAndTakenAddresses) {
  Program wrong({"--threads", "many"});
  EXPECT_NE(wrong.wait(), 0);
  Program first({"--address", "127.0.0.1:0"});
  const std::string address = first.address();
  Program second({"--address", address, "--log-level", "off"});
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(second.rest().find(address), std::string::npos);
}

TEST(Program, HealthcheckSaysWhetherAServerServes) {
  Program server({"--address", "127.0.0.1:0"});
  const std::string address = server.address();
  EXPECT_EQ(Program({"--healthcheck", address}).wait(), 0);
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(), 0);
  EXPECT_EQ(Program({"--healthcheck", address}).wait(), 1);
}

}  // namespace
}  // namespace lpdeform
