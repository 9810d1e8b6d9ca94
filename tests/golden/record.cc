// Golden recordings of the wire, from a real server in this process:
//   record FOLDER ERRORS_MD            writes them
//   record --check FOLDER ERRORS_MD    1 if the server answers the same requests differently
//
// frames.json: a session and, for each encoding, what is sent and received on a Deform stream until the result of one update,
// with the notice of an overloaded server; a step that is undone; a session as a file, and one restored from it. Messages
// are serialised, in base64. errors.json: each reason of proto/errors.md as the details of a call's status and as the fault
// of a stream. expected.txt: what every client must make of them, one fact per line; numbers are given by their bits.

#include <grpcpp/grpcpp.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/cpp/packer.h"
#include "client/cpp/status_details.h"
#include "client/cpp/wire.h"
#include "core/base/fault.h"
#include "lpdeform/v1/service.grpc.pb.h"
#include "server/server.h"
#include "server/wire/encode.h"
#include "server/wire/grpc_status.h"

namespace lpdeform {
namespace {

using Json = nlohmann::ordered_json;

/// Errors of ours end the program: a recording that is not whole is none.
void require(bool holds, const std::string& what) {
  if (holds) return;
  std::cerr << "record: " << what << "\n";
  std::_Exit(1);  // the server in this process has threads
}

std::string encoded(const google::protobuf::Message& message) {
  return absl::Base64Escape(message.SerializeAsString());
}

client::Packer inline_packer() {
  return client::Packer([](std::string_view) { return absl::InternalError("nothing here is that large"); });
}

/// Ten squares in a row, 22 vertices. All numbers are whole, so that any scalar carries them.
v1::CreateSessionRequest creation() {
  client::Mesh mesh;
  for (int k = 0; k <= 10; ++k) mesh.vertices.insert(mesh.vertices.end(), {double(k), 0, 0, double(k), 1, 0});
  for (std::uint32_t k = 0; k < 20; k += 2) {
    for (const std::uint32_t corner : {0U, 2U, 3U, 0U, 3U, 1U}) mesh.faces.push_back(k + corner);
  }
  client::Packer packer = inline_packer();
  v1::CreateSessionRequest request;
  require(client::to_wire(mesh, packer, *request.mutable_mesh()).ok(), "the mesh cannot be packed");
  return request;
}

/// The base stays, the tip is lifted and brought nearer.
v1::Update lift() {
  client::Update update;
  update.handles["base"] = client::Handle{.vertices = {0, 1}};
  update.handles["tip"] =
      client::Handle{.vertices = {20, 21}, .motion = client::RigidMotion{.translation = {-4, 0, 3}}};
  client::Packer packer = inline_packer();
  v1::Update out;
  require(client::to_wire(update, 1, packer, out).ok(), "the update cannot be packed");
  return out;
}

struct Way {
  const char* name;
  v1::Encoding encoding;
  v1::Scalar scalar;
};

constexpr Way kWays[] = {
    {"float64", v1::ENCODING_RAW, v1::SCALAR_FLOAT64},
    {"float32", v1::ENCODING_RAW, v1::SCALAR_FLOAT32},
    {"quantized", v1::ENCODING_QUANTIZED, v1::SCALAR_FLOAT32},
    {"compressed", v1::ENCODING_COMPRESSED, v1::SCALAR_FLOAT32},
};

struct Stream {
  v1::DeformOpen open;
  v1::Update update;
  std::vector<v1::DeformResponse> responses;  // the opening, a notice, the answer to the update, its result

  const v1::FramePart& frame() const { return responses.back().event().frame(); }
};

v1::CreateSessionResponse create(v1::DeformService::Stub& stub) {
  grpc::ClientContext context;
  v1::CreateSessionResponse response;
  const grpc::Status status = stub.CreateSession(&context, creation(), &response);
  require(status.ok(), status.error_message());
  return response;
}

/// What a server says that has more to do than it can.
v1::DeformResponse notice() {
  v1::DeformResponse out;
  out.mutable_event()->mutable_notice()->set_reason(v1::NOTICE_REASON_OVERLOADED);
  out.mutable_event()->mutable_notice()->set_text("The server has more to solve than it can.");
  return out;
}

Stream record_stream(v1::DeformService::Stub& stub, const v1::CreateSessionResponse& session,
                     const Way& way) {
  Stream out;
  out.open.set_session(session.session().name());
  out.open.set_writer_token(session.writer_token());
  out.open.mutable_options()->set_encoding(way.encoding);
  out.open.mutable_options()->set_scalar(way.scalar);
  out.open.mutable_options()->set_with_normals(true);
  out.update = lift();

  grpc::ClientContext context;
  const auto call = stub.Deform(&context);
  v1::DeformRequest request;
  *request.mutable_open() = out.open;
  call->Write(request);
  *request.mutable_update() = out.update;
  call->Write(request);
  v1::DeformResponse response, result;
  while (out.responses.size() < 2 || !result.has_event()) {  // the answer may come after the frame
    require(call->Read(&response), "the stream ended");
    if (!response.event().has_frame()) {
      out.responses.push_back(response);
      continue;
    }
    const v1::FramePart& part = response.event().frame();
    require(part.last(), "a frame came in several parts");
    request.mutable_ack()->set_frame_seq(part.frame_seq());
    call->Write(request);
    if (part.header().is_final() && part.header().input_seq() == 1) result = response;
  }
  out.responses.push_back(result);
  context.TryCancel();
  call->Finish();
  require(out.responses[0].event().has_opened() && out.responses[1].has_result(), "something else came");
  out.responses.insert(out.responses.begin() + 1, notice());
  return out;
}

// Calls about a session.

template <typename Request, typename Response>
Response ask(grpc::Status (v1::DeformService::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
             v1::DeformService::Stub& stub, const Request& request) {
  grpc::ClientContext context;
  Response response;
  const grpc::Status status = (stub.*method)(&context, request, &response);
  require(status.ok(), status.error_message());
  return response;
}

struct Undo {
  v1::UndoUpdateResponse response;
  v1::DeformResponse result;
};

/// Update 1 is the lift, update 2 takes the tip elsewhere, update 3 takes that back.
Undo record_undo(v1::DeformService::Stub& stub) {
  const v1::CreateSessionResponse session = create(stub);
  v1::UpdateHandlesRequest change;
  change.set_session(session.session().name());
  change.set_writer_token(session.writer_token());
  *change.mutable_update() = lift();
  ask(&v1::DeformService::Stub::UpdateHandles, stub, change);
  client::Update elsewhere;
  elsewhere.handles["tip"] = client::Motion(client::RigidMotion{.translation = {0, 0, 1}});
  elsewhere.begins_step = true;
  client::Packer packer = inline_packer();
  v1::Update second;
  require(client::to_wire(elsewhere, 2, packer, second).ok(), "the update cannot be packed");
  *change.mutable_update() = second;
  ask(&v1::DeformService::Stub::UpdateHandles, stub, change);

  Undo out;
  v1::UndoUpdateRequest back;
  back.set_session(session.session().name());
  back.set_writer_token(session.writer_token());
  back.set_input_seq(3);
  out.response = ask(&v1::DeformService::Stub::UndoUpdate, stub, back);
  require(out.response.changes_size() == 1 && out.response.changes(0).has_move(), "another step is undone");

  grpc::ClientContext context;
  const auto stream = stub.Deform(&context);
  v1::DeformRequest request;
  request.mutable_open()->set_session(session.session().name());
  request.mutable_open()->mutable_options()->set_with_normals(true);
  stream->Write(request);
  const auto is_result = [&] {
    const v1::FrameHeader& header = out.result.event().frame().header();
    return header.is_final() && header.input_seq() == 3;
  };
  while (!is_result()) {
    require(stream->Read(&out.result), "the stream ended");
    request.mutable_ack()->set_frame_seq(out.result.event().frame().frame_seq());
    if (out.result.event().has_frame()) stream->Write(request);
  }
  context.TryCancel();
  stream->Finish();
  return out;
}

std::string take_snapshot(v1::DeformService::Stub& stub, const std::string& session) {
  grpc::ClientContext context;
  v1::SnapshotSessionRequest request;
  request.set_session(session);
  const auto parts = stub.SnapshotSession(&context, request);
  std::string file;
  for (v1::SnapshotSessionResponse part; parts->Read(&part);) file += part.data();
  require(parts->Finish().ok() && !file.empty(), "there is no snapshot");
  return file;
}

v1::RestoreSessionResponse restore(v1::DeformService::Stub& stub, const std::string& file) {
  v1::RestoreSessionRequest request;
  request.mutable_snapshot()->set_inline_(file);
  return ask(&v1::DeformService::Stub::RestoreSession, stub, request);
}

// What clients make of a frame.

struct Numbers {
  std::vector<double> positions, distortion, normals;
};

template <typename T>
std::vector<T> numbers_of(const std::string& bytes) {
  std::vector<T> out(bytes.size() / sizeof(T));
  std::memcpy(out.data(), bytes.data(), out.size() * sizeof(T));
  return out;
}

template <typename T>
std::vector<double> doubles_of(const std::string& bytes) {
  const std::vector<T> numbers = numbers_of<T>(bytes);
  return {numbers.begin(), numbers.end()};
}

Numbers raw_numbers(const v1::FramePart& part) {
  if (part.header().scalar() == v1::SCALAR_FLOAT64) {
    return {doubles_of<double>(part.positions()), doubles_of<double>(part.distortion()),
            doubles_of<double>(part.normals())};
  }
  return {doubles_of<float>(part.positions()), doubles_of<float>(part.distortion()),
          doubles_of<float>(part.normals())};
}

/// As frame.proto says it: q times extent / 65535, and the origin.
Numbers quantized_numbers(const v1::FramePart& part) {
  const auto q = numbers_of<std::uint16_t>(part.positions());
  const auto n = numbers_of<std::int16_t>(part.normals());
  const v1::Quantization& box = part.header().quantization();
  const double origin[] = {box.origin().x(), box.origin().y(), box.origin().z()};
  const double step[] = {box.extent().x() / 65535, box.extent().y() / 65535, box.extent().z() / 65535};
  Numbers out;
  for (std::size_t i = 0; i < q.size(); i += 4) {
    for (int k = 0; k < 3; ++k) {
      out.positions.push_back(q[i + k] * step[k] + origin[k]);
      out.normals.push_back(n[i + k] / 32767.0);
    }
    out.distortion.push_back(q[i + 3] * (box.distortion_extent() / 65535));
  }
  return out;
}

std::string bits_of(const std::vector<double>& numbers) {
  std::string out;
  for (const double number : numbers) {
    out += absl::StrFormat(" %08x", std::bit_cast<std::uint32_t>(static_cast<float>(number)));
  }
  return out;
}

std::string lines_of(const std::string& name, const v1::FrameHeader& header, const Numbers& numbers) {
  return absl::StrFormat("%s: result %d, converged, iteration %d, energy %016x\n", name, header.is_final(),
                         header.iteration(), std::bit_cast<std::uint64_t>(header.energy())) +
         name + " positions:" + bits_of(numbers.positions) + "\n" + name +
         " distortion:" + bits_of(numbers.distortion) + "\n" + name + " normals:" + bits_of(numbers.normals) +
         "\n";
}

double furthest(const std::vector<double>& a, const std::vector<double>& b) {
  double most = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

// Errors.

struct Row {
  absl::StatusCode code;
  Fault fault;
  std::string text;

  absl::Status status() const { return carry_fault(code, fault, text); }
};

/// Each of the server's reasons in proto/errors.md, with an element, a limit and a text that are not alike, and not only ASCII.
std::vector<Row> rows_of(const std::string& errors_md) {
  std::ifstream file(errors_md);
  std::vector<Row> out;
  for (std::string line; std::getline(file, line) && line != "## From the client libraries";) {
    const std::vector<std::string> cells = absl::StrSplit(line, " | ");
    if (cells.size() != 4 || cells[0].rfind("| `", 0) != 0) continue;
    const std::string reason = cells[0].substr(3, cells[0].size() - 4);
    absl::StatusCode code = absl::StatusCode::kOk;
    for (int k = 1; k <= 16; ++k) {
      if (absl::StatusCodeToString(static_cast<absl::StatusCode>(k)) == cells[1])
        code = static_cast<absl::StatusCode>(k);
    }
    require(code != absl::StatusCode::kOk, "proto/errors.md has a code of its own: " + cells[1]);
    const std::string number = std::to_string(out.size());
    out.push_back({code,
                   {reason, "handle \"Größe " + number + "\"", "0 <= x < " + number},
                   "No. " + number + ": Größe."});
  }
  require(out.size() > 80, "proto/errors.md was not understood");
  return out;
}

std::string tell(const char* where, const Row& row) {
  return absl::StrFormat("%s %d %s | %s | %s | %s\n", where, static_cast<int>(row.code), row.fault.reason,
                         row.fault.element, row.fault.limit, row.text);
}

Json errors_json(const std::vector<Row>& rows) {
  Json out = Json::array();
  for (const Row& row : rows) {
    const grpc::Status status = to_grpc(row.status());
    v1::Fault fault;
    encode(FaultNote{row.status(), 1}, fault);
    out.push_back({{"code", static_cast<int>(status.error_code())},
                   {"text", status.error_message()},
                   {"details", absl::Base64Escape(status.error_details())},
                   {"fault", encoded(fault)}});
  }
  return out;
}

// Both.

struct Recording {
  Json frames, errors;
  std::string expected;
  std::vector<Numbers> numbers;  // of each way, then of the undo
};

Recording record(v1::DeformService::Stub& stub, const std::string& errors_md) {
  Recording out;
  out.frames["create_request"] = encoded(creation());
  Numbers exact;
  std::vector<std::uint16_t> integers;
  for (const Way& way : kWays) {
    const v1::CreateSessionResponse session = create(stub);
    const Stream stream = record_stream(stub, session, way);
    Json responses = Json::array();
    for (const v1::DeformResponse& response : stream.responses) responses.push_back(encoded(response));
    out.frames["streams"].push_back({{"name", way.name},
                                     {"create_response", encoded(session)},
                                     {"open", encoded(stream.open)},
                                     {"update", encoded(stream.update)},
                                     {"responses", responses}});
    const bool is_raw = way.encoding == v1::ENCODING_RAW;
    // Compressed blocks are the clients' to read: their numbers must be those that came quantized.
    if (way.encoding != v1::ENCODING_COMPRESSED) {
      out.numbers.push_back(is_raw ? raw_numbers(stream.frame()) : quantized_numbers(stream.frame()));
    } else {
      out.numbers.push_back(out.numbers.back());
    }
    out.expected += lines_of(way.name, stream.frame().header(), out.numbers.back());
    out.expected += std::string(way.name) + " notice: overloaded, " + notice().event().notice().text() + "\n";
  }
  const Undo undone = record_undo(stub);
  out.frames["undo"] = {{"response", encoded(undone.response)}, {"result", encoded(undone.result)}};
  out.numbers.push_back(raw_numbers(undone.result.event().frame()));
  const v1::FrameHeader& settled = undone.result.event().frame().header();
  const std::string again = absl::StrFormat("settled again: converged, iteration %d\n", settled.iteration());
  out.expected += again + "settled again: NO_FRAME\n" + lines_of("undo", settled, out.numbers.back()) + again;
  const std::string file = take_snapshot(stub, create(stub).session().name());
  const v1::RestoreSessionResponse restored = restore(stub, file);
  out.frames["snapshot"] = {{"file", absl::Base64Escape(file)}, {"restore_response", encoded(restored)}};
  out.expected +=
      absl::StrFormat("snapshot: %d bytes\nrestored: %s\n", file.size(), restored.session().name());
  const std::vector<Row> rows = rows_of(errors_md);
  out.errors = errors_json(rows);
  for (const Row& row : rows) out.expected += tell("call", row);
  for (const Row& row : rows) out.expected += tell("fault", row);
  return out;
}

std::string read_file(const std::string& path) {
  std::ifstream file(path);
  require(file.good(), path + " cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

/// The numbers of a frame's line in expected.txt.
std::vector<double> expected_numbers(const std::string& expected, const std::string& line) {
  const std::size_t start = expected.find(line + ":");
  require(start != std::string::npos, "expected.txt has no " + line);
  std::istringstream words(
      expected.substr(start + line.size() + 1, expected.find('\n', start) - start - line.size() - 1));
  std::vector<double> out;
  for (std::string word; words >> word;) {
    out.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(std::stoul(word, nullptr, 16))));
  }
  return out;
}

/// The same solve may take other steps to its result; 10 is the length of the strip.
constexpr double kSameResult = 1e-3 * 10;

/// The same to a reader: entries of a map may come in any order.
void check_errors(const Json& now, const Json& then) {
  require(now.size() == then.size(),
          "proto/errors.md has other reasons than the recording; record again: "
          "build/release/bin/golden_record tests/golden proto/errors.md");
  for (std::size_t k = 0; k < now.size(); ++k) {
    const auto read = [k](const Json& errors) {
      std::string details;
      require(absl::Base64Unescape(errors[k]["details"].get<std::string>(), &details), "not base64");
      return fault_of(client::with_details(absl::StatusCode(errors[k]["code"].get<int>()), "", details));
    };
    require(
        now[k]["fault"] == then[k]["fault"] && now[k]["text"] == then[k]["text"] && read(now) == read(then),
        "an error is no longer said so: " + read(then).reason);
  }
}

void check(const Recording& now, const std::string& folder) {
  const std::string expected = read_file(folder + "/expected.txt");
  const Json frames = Json::parse(read_file(folder + "/frames.json"));
  require(frames["create_request"] == now.frames["create_request"], "another request is sent");
  check_errors(now.errors, Json::parse(read_file(folder + "/errors.json")));
  for (std::size_t k = 0; k < std::size(kWays); ++k) {
    const std::string name = kWays[k].name;
    require(frames["streams"][k]["update"] == now.frames["streams"][k]["update"], "another update is sent");
    require(furthest(now.numbers[k].positions, expected_numbers(expected, name + " positions")) < kSameResult,
            "frames in " + name + " have other positions");
    require(furthest(now.numbers[k].normals, expected_numbers(expected, name + " normals")) < 0.01,
            "frames in " + name + " have other normals");
  }
}

void check_calls(v1::DeformService::Stub& stub, const Recording& now, const std::string& expected,
                 const Json& frames) {
  require(frames["undo"]["response"] == now.frames["undo"]["response"], "an undo is answered otherwise");
  require(furthest(now.numbers.back().positions, expected_numbers(expected, "undo positions")) < kSameResult,
          "frames after an undo have other positions");
  std::string file;
  require(absl::Base64Unescape(frames["snapshot"]["file"].get<std::string>(), &file), "not base64");
  const v1::Session session = restore(stub, file).session();  // recorded by a release before, perhaps
  require(session.mesh().vertices() == 22, "the recorded snapshot is another session");
}

int run(bool is_check, const std::string& folder, const std::string& errors_md) {
  ServerOptions options;
  options.address = "127.0.0.1:0";
  options.threads = 1;
  const auto server = Server::start(options);
  require(server.ok(), server.ok() ? "" : std::string(server.status().message()));
  const auto channel = grpc::CreateChannel((*server)->address(), grpc::InsecureChannelCredentials());
  const auto stub = v1::DeformService::NewStub(channel);
  const Recording now = record(*stub, errors_md);
  // Rounded numbers are the exact ones, as near as their encoding promises: the solves are the same to the last bit.
  require(furthest(now.numbers[0].positions, now.numbers[1].positions) < 1e-6,
          "float32 is not float64 rounded");
  require(furthest(now.numbers[0].positions, now.numbers[2].positions) < 10.1 / 131070,
          "quantized is not near");
  if (is_check) {
    check(now, folder);
    check_calls(*stub, now, read_file(folder + "/expected.txt"),
                Json::parse(read_file(folder + "/frames.json")));
  } else {
    write_file(folder + "/frames.json", now.frames.dump(1) + "\n");
    write_file(folder + "/errors.json", now.errors.dump(1) + "\n");
    write_file(folder + "/expected.txt", now.expected);
  }
  return 0;
}

}  // namespace
}  // namespace lpdeform

int main(int argc, char** argv) {
  const bool is_check = argc == 4 && std::strcmp(argv[1], "--check") == 0;
  if (!is_check && argc != 3) return 2;
  return lpdeform::run(is_check, argv[argc - 2], argv[argc - 1]);
}
