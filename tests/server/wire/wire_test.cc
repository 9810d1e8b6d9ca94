// Values to messages and back, without a network.

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <tuple>

#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/session/publisher.h"
#include "server/wire/decode.h"
#include "server/wire/encode.h"
#include "server/wire/frame_slices.h"

namespace lpdeform {
namespace {

std::string reason(const absl::Status& status) {
  return fault_of(status).reason;
}

class WireTest : public testing::Test {
 protected:
  Decoder decoder(std::uint32_t vertex_count) { return {*uploads_, vertex_count}; }

  std::string upload(const std::string& bytes) {
    const auto upload = *uploads_->create("", bytes.size(), crc32c(bytes));
    for (std::size_t at = 0; at < bytes.size(); at += Upload::kMostPartBytes) {
      EXPECT_TRUE(upload->add(at, std::string_view(bytes).substr(at, Upload::kMostPartBytes)).ok());
    }
    return upload->name();
  }

  std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  std::shared_ptr<Budget> budget_ = std::make_shared<Budget>(std::size_t{1} << 28);
  std::shared_ptr<Uploads> uploads_ = std::make_shared<Uploads>(
      budget_, timers_, Uploads::Limits{std::uint64_t{1} << 26, std::chrono::minutes(10)});
};

TEST_F(WireTest, NamingAnUploadManyTimesDoesNotMultiplyItsMemory) {
  const std::string name = upload(std::string(4 << 20, '\0'));
  v1::Update message;
  message.set_input_seq(1);
  for (int k = 0; k < 1000; ++k) {
    v1::HandleUpdate& handle = *message.add_handles();
    handle.set_name("h");
    handle.mutable_set()->mutable_vertices()->set_upload(name);
  }
  EXPECT_EQ(reason(decoder(2'000'000).update(message).status()), "HANDLE_TOO_MANY_VERTICES");
  message.clear_handles();
  for (int k = 0; k < 1000; ++k) {
    v1::TargetPositions& targets = *message.add_handles()->mutable_move()->mutable_targets();
    targets.set_scalar(v1::SCALAR_FLOAT32);
    targets.mutable_positions()->set_upload(upload(std::string(12 * 100, '\0')));
  }
  EXPECT_EQ(reason(decoder(50'000).update(message).status()), "HANDLE_TOO_MANY_VERTICES");
}

TEST_F(WireTest, AMeshThatIsForgedIsRefusedBeforeMemoryIsTaken) {
  v1::Mesh mesh;
  mesh.set_vertex_count(0xffffffff);
  mesh.set_face_count(0xffffffff);
  mesh.mutable_data()->set_inline_("abc");
  const Decoder::MeshLimits limits{0xffffffff, 0xffffffff};
  EXPECT_EQ(reason(decoder(0xffffffff).check_mesh_size(mesh, limits)), "BUFFER_SIZE");
  EXPECT_EQ(reason(decoder(0xffffffff).mesh(mesh).status()), "BUFFER_SIZE");
  mesh.mutable_data()->set_upload("uploads/unknown");
  EXPECT_EQ(reason(decoder(0xffffffff).mesh(mesh).status()), "UPLOAD_UNKNOWN");
}

TEST_F(WireTest, SizesThatAreNoWholeNumberOfNumbersAreRefused) {
  v1::HandleUpdate update;
  v1::Update message;
  v1::HandleUpdate& handle = *message.add_handles();
  handle.mutable_set()->mutable_vertices()->set_inline_("12345");
  EXPECT_EQ(reason(decoder(10).update(message).status()), "BUFFER_SIZE");
  v1::TargetPositions& targets = *handle.mutable_move()->mutable_targets();
  targets.mutable_positions()->set_inline_(std::string(13, '\0'));
  EXPECT_EQ(reason(decoder(10).update(message).status()), "BUFFER_SIZE");
}

TEST_F(WireTest, FloatsAndDoublesBothBecomeDoubles) {
  v1::Positions message;
  const float narrow[] = {0.1f, 2, -3};
  message.mutable_data()->set_inline_(std::string(reinterpret_cast<const char*>(narrow), sizeof(narrow)));
  EXPECT_EQ((*decoder(1).positions(message))(0, 0), static_cast<double>(0.1f));
  const double wide[] = {0.1, 2, -3};
  message.set_scalar(v1::SCALAR_FLOAT64);
  message.mutable_data()->set_inline_(std::string(reinterpret_cast<const char*>(wide), sizeof(wide)));
  EXPECT_EQ((*decoder(1).positions(message))(0, 0), 0.1);
  EXPECT_EQ(reason(decoder(2).positions(message).status()), "POSITIONS_SIZE");
}

/// Numbers that no std::int32_t can hold.
TEST_F(WireTest, AnIndexThatDoesNotFitIsNamedAsItWasSent) {
  for (const std::uint32_t index : {0x80000000u, 0xffffffffu}) {
    const std::string bytes(reinterpret_cast<const char*>(&index), 4), number = std::to_string(index);
    v1::Update vertices, points, region;
    v1::HandleUpdate& handle = *vertices.add_handles();
    handle.set_name("a");
    handle.mutable_set()->mutable_vertices()->set_inline_(bytes);
    *points.add_handles() = handle;
    points.mutable_handles(0)->mutable_set()->clear_vertices();
    points.mutable_handles(0)->mutable_set()->mutable_points()->mutable_faces()->set_inline_(bytes);
    region.mutable_settings()->mutable_region()->mutable_vertices()->set_inline_(bytes);
    for (const auto& [message, why, element] :
         {std::tuple(vertices, "HANDLE_VERTEX_OUT_OF_RANGE", "vertex " + number),
          std::tuple(points, "HANDLE_FACE_OUT_OF_RANGE", "face " + number),
          std::tuple(region, "REGION_VERTEX_OUT_OF_RANGE", "vertex " + number)}) {
      const absl::Status status = decoder(10).update(message).status();
      EXPECT_EQ(reason(status), why);
      EXPECT_EQ(fault_of(status).element, element);
      EXPECT_TRUE(status.message().find(number) != std::string_view::npos) << status;
    }
    v1::Weld weld;
    weld.mutable_groups()->set_inline_(bytes);
    const absl::Status status = decoder(1).weld(weld, Points::Zero(1, 3)).status();
    EXPECT_EQ(reason(status), "WELD_OUT_OF_RANGE");
    EXPECT_TRUE(status.message().find(number) != std::string_view::npos) << status;
    v1::SettingsUpdate settings;
    settings.mutable_solver()->set_max_iterations(index);
    const absl::Status too_many = decoder(1).settings(settings).status();
    EXPECT_EQ(reason(too_many), "ITERATIONS_OUT_OF_RANGE");
    EXPECT_TRUE(too_many.message().find(number) != std::string_view::npos) << too_many;
  }
}

TEST_F(WireTest, AnIndexThatJustFitsIsLeftToTheCheckOfTheMesh) {
  v1::Update message;
  message.add_handles()->mutable_set()->mutable_vertices()->set_inline_("\xff\xff\xff\x7f");
  const auto update = decoder(10).update(message);
  ASSERT_TRUE(update.ok());
  EXPECT_EQ(std::get<Handle>(update->handles[0].change).vertices[0],
            std::numeric_limits<std::int32_t>::max());
}

TEST_F(WireTest, SolverSettingsTakeTheirDefaultsFromZero) {
  v1::SettingsUpdate message;
  message.mutable_solver();
  const auto settings = decoder(1).settings(message);
  ASSERT_TRUE(settings.ok());
  EXPECT_EQ(settings->solver->tolerance, SolveSettings::kDefaultTolerance);
  EXPECT_EQ(settings->solver->max_iterations, SolveSettings().max_iterations);
  EXPECT_EQ(settings->solver->time_limit_seconds, std::numeric_limits<double>::infinity());
  message.mutable_solver()->set_method(static_cast<v1::Method>(99));
  EXPECT_EQ(reason(decoder(1).settings(message).status()), "ENUM_UNKNOWN");
}

TEST_F(WireTest, EncodingsAreAsAskedForAndTheLowestIsNeverAboveThem) {
  v1::FrameOptions message;
  const auto decoded = [&] { return *decode_frame_options(message); };
  EXPECT_EQ(decoded().format, Format::kFloat32);
  EXPECT_EQ(decoded().lowest_format, Format::kFloat32);
  message.set_scalar(v1::SCALAR_FLOAT64);
  EXPECT_EQ(decoded().format, Format::kFloat64);
  EXPECT_EQ(decoded().lowest_format, Format::kFloat64);
  message.set_encoding(v1::ENCODING_RAW);
  message.set_lowest_encoding(v1::ENCODING_RAW);
  EXPECT_EQ(decoded().format, Format::kFloat64);
  EXPECT_EQ(decoded().lowest_format, Format::kFloat32);
  message.set_lowest_encoding(v1::ENCODING_COMPRESSED);
  EXPECT_EQ(decoded().lowest_format, Format::kCompressed);
  message.set_encoding(v1::ENCODING_COMPRESSED);
  message.set_lowest_encoding(v1::ENCODING_QUANTIZED);
  EXPECT_EQ(decoded().format, Format::kCompressed);
  EXPECT_EQ(decoded().lowest_format, Format::kCompressed);
  message.set_encoding(static_cast<v1::Encoding>(9));
  EXPECT_EQ(reason(decode_frame_options(message).status()), "ENUM_UNKNOWN");
  message.set_encoding(v1::ENCODING_RAW);
  message.set_lowest_encoding(static_cast<v1::Encoding>(9));
  EXPECT_EQ(reason(decode_frame_options(message).status()), "ENUM_UNKNOWN");
}

/// As gRPC sends it.
template <typename Message>
std::string written(const Outgoing<Message>& out) {
  grpc::ByteBuffer buffer;
  bool is_ours = false;
  EXPECT_TRUE(grpc::SerializationTraits<Outgoing<Message>>::Serialize(out, &buffer, &is_ours).ok());
  grpc::Slice slice;
  EXPECT_TRUE(buffer.DumpToSingleSlice(&slice).ok());
  EXPECT_EQ(slice.size(), out.ByteSizeLong());
  return {reinterpret_cast<const char*>(slice.begin()), slice.size()};
}

/// Triangles around vertex 0, no two numbers of a vertex alike.
std::shared_ptr<const RestShape> fan(std::uint32_t vertices) {
  TriangleMesh mesh{Points(vertices, 3), Faces(vertices - 2, 3)};
  for (std::uint32_t v = 0; v < vertices; ++v)
    mesh.vertices.row(v) << std::cos(6.0 * v / vertices), std::sin(6.0 * v / vertices), 0.3 + 1e-3 * v;
  for (std::uint32_t f = 0; f + 2 < vertices; ++f)
    mesh.faces.row(f) << 0, static_cast<int>(f) + 1, static_cast<int>(f) + 2;
  return RestShape::create(mesh).value();
}

class AlignmentTest : public testing::TestWithParam<std::tuple<std::uint32_t, Format>> {};

TEST_P(AlignmentTest, BuffersCanBeUsedInPlaceInEveryMessage) {
  const auto [n, format] = GetParam();
  const std::size_t unit = format == Format::kFloat64 ? 8 : 4;
  const auto timers = std::make_shared<ManualTimers>();
  const auto publisher = std::make_shared<Publisher>();
  Frame frame;
  const auto mesh = std::make_shared<const DrawMesh>(fan(n));
  frame.surface =
      std::make_shared<Surface>(mesh->positions(fan(n)->positions()), Field::Constant(n, 9.25), mesh);
  const auto expect_aligned = [&](const auto& out, auto message, const FramePiece& piece, auto part_of) {
    const std::string bytes = written(out);
    ASSERT_TRUE(message.ParseFromString(bytes));
    EXPECT_TRUE(message.SerializeAsString() == bytes);  // as protobuf would have written it
    const v1::FramePart& part = part_of(message);
    EXPECT_EQ(part.frame_seq(), piece.frame->frame_seq);
    EXPECT_EQ(part.vertex_count(), piece.count);
    EXPECT_TRUE(part.positions() == piece.bytes().positions);
    EXPECT_TRUE(part.distortion() == piece.bytes().distortion);
    EXPECT_TRUE(part.normals() == piece.bytes().normals);
    for (const std::string& numbers : {part.positions(), part.distortion(), part.normals()})
      EXPECT_TRUE(numbers.empty() || bytes.find(numbers) % unit == 0) << numbers.size();
  };
  const auto in_event = [](const auto& message) -> const v1::FramePart& { return message.event().frame(); };
  const auto in_answer = [](const v1::SolveResponse& message) -> const v1::FramePart& {
    return message.frame();
  };
  for (const std::uint64_t seq : {1u, 127u, 128u, 20000u}) {
    for (const int extras : {0, 1, 2, 3}) {
      for (const std::uint32_t first : {0u, 1u}) {
        const bool with_distortion = extras % 2 == 1, with_normals = extras >= 2;
        frame.frame_seq = seq;
        const FramePiece piece{std::make_shared<Frame>(frame),
                               first,
                               n - first,
                               true,
                               seq,
                               format,
                               with_distortion,
                               with_normals};
        const FrameStream stream({}, publisher, timers, std::chrono::seconds(15), {});
        Outgoing<v1::DeformResponse> deform;
        encode(piece, stream, n, deform);
        expect_aligned(deform, v1::DeformResponse(), piece, in_event);
        Outgoing<v1::StreamFramesResponse> frames;
        encode(piece, stream, n, frames);
        expect_aligned(frames, v1::StreamFramesResponse(), piece, in_event);
        Outgoing<v1::StreamSessionsResponse> sessions;
        sessions.message.set_stream(extras);
        encode(piece, stream, n, sessions);
        expect_aligned(sessions, v1::StreamSessionsResponse(), piece, in_event);
        EXPECT_EQ(sessions.message.stream(), static_cast<std::uint32_t>(extras));
        Outgoing<v1::SolveResponse> solve;
        encode(piece, solve);
        expect_aligned(solve, v1::SolveResponse(), piece, in_answer);
      }
    }
  }
}

TEST(Outgoing, NumbersOutliveTheFrameUntilTheyAreSent) {
  const auto shape = fan(5);
  auto surface = std::make_shared<const Surface>(shape->positions(), Field::Constant(5, 9.25));
  const std::weak_ptr<const Surface> watched = surface;
  Outgoing<v1::SolveResponse> out;
  {
    auto frame = std::make_shared<Frame>();
    frame->surface = std::move(surface);
    encode(FramePiece{std::move(frame), 0, 5, true, 0, Format::kFloat64, true, false}, out);
  }
  grpc::ByteBuffer buffer;
  bool is_ours = false;
  ASSERT_TRUE(grpc::SerializationTraits<Outgoing<v1::SolveResponse>>::Serialize(out, &buffer, &is_ours).ok());
  out.Clear();
  EXPECT_FALSE(watched.expired());
  v1::SolveResponse message;
  ASSERT_TRUE(grpc::SerializationTraits<v1::SolveResponse>::Deserialize(&buffer, &message).ok());
  EXPECT_EQ(message.frame().distortion().size(), 5 * sizeof(double));
  buffer.Clear();
  EXPECT_TRUE(watched.expired());
}

INSTANTIATE_TEST_SUITE_P(Sizes, AlignmentTest,
                         testing::Combine(testing::Values(3, 4, 5, 9, 10, 11, 31, 32, 33, 300, 340, 341, 1363,
                                                          1364, 1365, 4095, 4096, 26000),
                                          testing::Values(Format::kFloat32, Format::kFloat64,
                                                          Format::kQuantized)));

}  // namespace
}  // namespace lpdeform
