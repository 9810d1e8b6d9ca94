// StreamSessions of the running service: several sessions on one stream.

#include <map>
#include <thread>

#include "service_fixture.h"

namespace lpdeform {
namespace {

class SessionsStreamTest : public ServiceTest {
 protected:
  /// The stream as a client has it.
  class Stream {
   public:
    Stream(v1::DeformService::Stub& stub, const std::vector<std::string>& sessions,
           v1::FrameOptions options = {}) {
      v1::StreamSessionsRequest request;
      for (const std::string& session : sessions) {
        request.add_streams()->set_session(session);
        *request.mutable_streams(request.streams_size() - 1)->mutable_options() = options;
      }
      context_.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
      reader_ = stub.StreamSessions(&context_, request);
    }
    ~Stream() { context_.TryCancel(); }

    std::optional<v1::StreamSessionsResponse> read() {
      v1::StreamSessionsResponse response;
      if (!reader_->Read(&response)) return std::nullopt;
      if (response.event().has_opened()) ids[response.stream()] = response.event().opened().stream_id();
      return response;
    }

    /// The next message of this stream that is a frame.
    std::optional<v1::FramePart> next_frame(std::uint32_t stream) {
      while (const auto response = read()) {
        if (response->stream() == stream && response->event().has_frame()) return response->event().frame();
      }
      return std::nullopt;
    }

    grpc::Status finish() {
      while (read()) {
      }
      return reader_->Finish();
    }

    std::map<std::uint32_t, std::string> ids;

   private:
    grpc::ClientContext context_;
    std::unique_ptr<grpc::ClientReader<v1::StreamSessionsResponse>> reader_;
  };

  grpc::Status acknowledge(const std::string& session, const std::string& id, std::uint64_t frame_seq) {
    grpc::ClientContext context;
    v1::AckFramesRequest request;
    request.set_session(session);
    request.set_stream_id(id);
    request.set_frame_seq(frame_seq);
    v1::AckFramesResponse response;
    return stub_->AckFrames(&context, request, &response);
  }

  void remove(const v1::CreateSessionResponse& session) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    request.set_session(session.session().name());
    v1::DeleteSessionResponse response;
    ASSERT_TRUE(stub_->DeleteSession(&context, request, &response).ok());
  }
};

TEST_F(SessionsStreamTest, EachSessionsFramesComeUnderItsNumber) {
  const auto small = create(bar_mesh()), large = create(bar_mesh());
  Stream stream(*stub_, {small.session().name(), large.session().name()});
  ASSERT_TRUE(update(small, ends_message(bar_mesh().vertices, 1, 1)).ok());
  ASSERT_TRUE(update(large, ends_message(bar_mesh().vertices, 1, 5)).ok());
  std::map<std::uint32_t, double> tips;
  const auto tip = static_cast<std::size_t>(vertices_at(bar_mesh().vertices, 21)[0]);
  while (tips.size() < 2) {
    const auto response = stream.read();
    ASSERT_TRUE(response);
    const v1::StreamEvent& event = response->event();
    if (!event.has_frame()) continue;
    const std::string& session = response->stream() == 0 ? small.session().name() : large.session().name();
    ASSERT_TRUE(acknowledge(session, stream.ids[response->stream()], event.frame().frame_seq()).ok());
    if (!event.frame().header().is_final() || event.frame().header().input_seq() == 0) continue;
    float x = 0;
    std::memcpy(&x, event.frame().positions().data() + 12 * tip, sizeof(x));
    tips[response->stream()] = x - bar_mesh().vertices(static_cast<Eigen::Index>(tip), 0);
  }
  EXPECT_NEAR(tips[0], 1, 1e-5);
  EXPECT_NEAR(tips[1], 5, 1e-5);
}

TEST_F(SessionsStreamTest, CreditIsEachSessionsOwn) {
  const auto one = create(bar_mesh()), other = create(bar_mesh());
  v1::FrameOptions options;
  options.set_credit(1);
  Stream stream(*stub_, {one.session().name(), other.session().name()}, options);
  ASSERT_TRUE(stream.next_frame(0));  // never acknowledged
  ASSERT_TRUE(update(one, ends_message(bar_mesh().vertices, 1, 1)).ok());
  ASSERT_TRUE(update(other, ends_message(bar_mesh().vertices, 1, 1)).ok());
  for (bool is_final = false; !is_final;) {
    const auto response = stream.read();
    ASSERT_TRUE(response);
    if (!response->event().has_frame()) continue;
    ASSERT_EQ(response->stream(), 1u);
    const v1::FramePart& frame = response->event().frame();
    ASSERT_TRUE(acknowledge(other.session().name(), stream.ids[1], frame.frame_seq()).ok());
    is_final = frame.header().is_final() && frame.header().input_seq() == 1;
  }
}

TEST_F(SessionsStreamTest, ASessionThatIsNotThereLeavesTheOthers) {
  const auto session = create(bar_mesh());
  Stream stream(*stub_, {"sessions/nothing", session.session().name()});
  std::vector<v1::StreamEvent> about_the_first;
  while (about_the_first.size() < 2) {
    const auto response = stream.read();
    ASSERT_TRUE(response);
    if (response->stream() == 0) about_the_first.push_back(response->event());
  }
  EXPECT_EQ(about_the_first[0].fault().reason(), "SESSION_UNKNOWN");
  EXPECT_EQ(about_the_first[0].fault().code(), grpc::NOT_FOUND);
  EXPECT_EQ(about_the_first[1].go_away().reason(), v1::GO_AWAY_REASON_NOT_OPENED);
  ASSERT_TRUE(update(session, ends_message(bar_mesh().vertices, 1, 1)).ok());
  EXPECT_TRUE(stream.next_frame(1));
}

TEST_F(SessionsStreamTest, EndsWithTheLastOfItsSessions) {
  const auto one = create(bar_mesh()), other = create(bar_mesh());
  Stream stream(*stub_, {one.session().name(), other.session().name(), "sessions/nothing"});
  ASSERT_TRUE(stream.next_frame(1));
  remove(one);
  for (bool is_gone = false; !is_gone;) {
    const auto response = stream.read();
    ASSERT_TRUE(response);
    is_gone =
        response->stream() == 0 && response->event().go_away().reason() == v1::GO_AWAY_REASON_SESSION_DELETED;
  }
  ASSERT_TRUE(update(other, ends_message(bar_mesh().vertices, 1, 1)).ok());
  ASSERT_TRUE(stream.next_frame(1));
  remove(other);
  EXPECT_TRUE(stream.finish().ok());
}

TEST_F(SessionsStreamTest, NoneOrTooManyAreRefused) {
  for (const std::size_t count : {0u, 17u}) {
    const grpc::Status status = Stream(*stub_, std::vector<std::string>(count, "sessions/nothing")).finish();
    EXPECT_EQ(status.error_code(), grpc::INVALID_ARGUMENT);
    EXPECT_EQ(details_of(status).info.reason(), "STREAMS_COUNT");
  }
  EXPECT_TRUE(Stream(*stub_, std::vector<std::string>(16, "sessions/nothing")).finish().ok());
}

TEST_F(SessionsStreamTest, DrainingEndsIt) {
  const auto session = create(bar_mesh());
  Stream stream(*stub_, {session.session().name(), session.session().name()});
  ASSERT_TRUE(stream.next_frame(0));
  std::thread draining([this] { server_->drain(std::chrono::seconds(20)); });
  int ends = 0;
  while (const auto response = stream.read()) {
    if (response->event().go_away().reason() == v1::GO_AWAY_REASON_DRAINING) ++ends;
  }
  EXPECT_EQ(ends, 2);
  draining.join();
}

}  // namespace
}  // namespace lpdeform
