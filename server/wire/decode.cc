// Decoder: whole updates, settings, bytes and enums.

#include "server/wire/decode.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/given/given.h"
#include "server/wire/decode_parts.h"

namespace lpdeform {
namespace {

constexpr std::size_t kMostInlineBytes = 1u << 20;

absl::StatusOr<Method> decode_method(v1::Method method) {
  switch (method) {
    case v1::METHOD_UNSPECIFIED:
      return Method::kAuto;
    case v1::METHOD_QUASI_NEWTON:
      return Method::kQuasiNewton;
    case v1::METHOD_LINE_SEARCH:
      return Method::kLineSearch;
    case v1::METHOD_LOCAL_GLOBAL:
      return Method::kLocalGlobal;
    case v1::METHOD_CONIC:
      return Method::kConic;
    case v1::METHOD_MULTIRESOLUTION:
      return Method::kMultiresolution;
    default:
      return unknown_enum("method", method);
  }
}

absl::StatusOr<Format> decode_encoding(v1::Encoding encoding, Format unspecified, Format raw) {
  switch (encoding) {
    case v1::ENCODING_UNSPECIFIED:
      return unspecified;
    case v1::ENCODING_RAW:
      return raw;
    case v1::ENCODING_QUANTIZED:
      return Format::kQuantized;
    case v1::ENCODING_COMPRESSED:
      return Format::kCompressed;
    default:
      return unknown_enum("encoding", encoding);
  }
}

absl::StatusOr<InitialGuess> decode_initial(v1::InitialGuess initial) {
  switch (initial) {
    case v1::INITIAL_GUESS_UNSPECIFIED:
      return InitialGuess::kCurrent;
    case v1::INITIAL_GUESS_LAPLACIAN:
      return InitialGuess::kLaplacian;
    case v1::INITIAL_GUESS_REST:
      return InitialGuess::kRest;
    default:
      return unknown_enum("initial guess", initial);
  }
}

absl::StatusOr<SolveSettings> decode_solver(const v1::SolverSettings& message) {
  const auto method = decode_method(message.method());
  if (!method.ok()) return method.status();
  const auto initial = decode_initial(message.initial());
  if (!initial.ok()) return initial.status();
  SolveSettings settings;
  settings.method = *method;
  settings.initial = *initial;
  if (message.has_search()) {
    const v1::MinimaSearch& search = message.search();
    const auto effort = given_effort(search.effort());
    if (!effort.ok()) return effort.status();
    if (search.has_effort()) settings.effort = *effort;
    settings.standing.shows = search.show();
    if (search.least_share() != 0) settings.standing.least_share = search.least_share();
  }
  if (message.tolerance() != 0) settings.tolerance = message.tolerance();
  if (message.time_limit_seconds() != 0) settings.time_limit_seconds = message.time_limit_seconds();
  const auto iterations = given_iterations(message.max_iterations());
  if (!iterations.ok()) return iterations.status();
  if (*iterations != 0) settings.max_iterations = *iterations;
  return settings;
}

}  // namespace

absl::Status unknown_enum(std::string_view what, int value) {
  return make_fault({Reason::kEnumUnknown, std::string(what), ""},
                    absl::StrCat("The server does not know ", std::string(what), " ", value, "."));
}

absl::Status wrong_size(std::string_view what, std::uint64_t is, const std::string& should) {
  return make_fault({Reason::kBufferSize, std::string(what), should},
                    absl::StrCat("The ", std::string(what), " have ", is, " bytes, not ", should, "."));
}

absl::StatusOr<Scalar> decode_scalar(v1::Scalar scalar) {
  switch (scalar) {
    case v1::SCALAR_UNSPECIFIED:
    case v1::SCALAR_FLOAT32:
      return Scalar::kFloat32;
    case v1::SCALAR_FLOAT64:
      return Scalar::kFloat64;
    default:
      return unknown_enum("scalar", scalar);
  }
}

absl::StatusOr<WeightKind> decode_weights(v1::WeightKind weights) {
  switch (weights) {
    case v1::WEIGHT_KIND_UNSPECIFIED:
    case v1::WEIGHT_KIND_COTANGENT:
      return WeightKind::kCotangent;
    case v1::WEIGHT_KIND_UNIFORM:
      return WeightKind::kUniform;
    case v1::WEIGHT_KIND_INTRINSIC_DELAUNAY:
      return WeightKind::kIntrinsicDelaunay;
    default:
      return unknown_enum("weight kind", weights);
  }
}

absl::StatusOr<FreeComponents> decode_free_components(v1::FreeComponents free_components) {
  switch (free_components) {
    case v1::FREE_COMPONENTS_UNSPECIFIED:
    case v1::FREE_COMPONENTS_ERROR:
      return FreeComponents::kError;
    case v1::FREE_COMPONENTS_STAY:
      return FreeComponents::kStay;
    case v1::FREE_COMPONENTS_FOLLOW:
      return FreeComponents::kFollow;
    default:
      return unknown_enum("treatment of free components", free_components);
  }
}

absl::StatusOr<StreamOptions> decode_frame_options(const v1::FrameOptions& message) {
  const auto scalar = decode_scalar(message.scalar());
  if (!scalar.ok()) return scalar.status();
  const auto encoding = decode_encoding(message.encoding(), format_of(*scalar), format_of(*scalar));
  if (!encoding.ok()) return encoding.status();
  const auto lowest = decode_encoding(message.lowest_encoding(), *encoding, Format::kFloat32);
  if (!lowest.ok()) return lowest.status();
  StreamOptions options;
  options.format = *encoding;
  options.lowest_format = std::max(*encoding, *lowest);
  options.with_distortion = !message.without_distortion();
  options.with_normals = message.with_normals();
  options.with_certificate = message.certify();
  if (message.credit() != 0) options.credit = message.credit();
  options.max_frames_per_second = message.max_frames_per_second();
  if (absl::Status status = check_stream_options(options); !status.ok()) return status;
  return options;
}

Decoder Decoder::reading_stored(const StoredBlobs& blobs) const {
  Decoder decoder(*this);
  decoder.stored_ = &blobs;
  return decoder;
}

absl::StatusOr<std::string> Decoder::raw(const v1::Buffer& buffer, std::string_view what) {
  const auto data = bytes(buffer, what);
  if (!data.ok()) return data.status();
  return std::string(data->view);
}

absl::StatusOr<Decoder::Bytes> Decoder::bytes(const v1::Buffer& buffer, std::string_view what) {
  if (buffer.has_inline_()) {
    if (stored_ != nullptr || buffer.inline_().size() <= kMostInlineBytes)
      return Bytes{nullptr, buffer.inline_()};
    return make_fault({Reason::kInlineTooLarge, std::string(what), absl::StrCat(kMostInlineBytes, " bytes")},
                      absl::StrCat("The ", std::string(what), " have ", buffer.inline_().size(),
                                   " bytes inline, over ", kMostInlineBytes, "; upload them."));
  }
  if (!buffer.has_upload()) {
    return make_fault({Reason::kBufferMissing, std::string(what), ""},
                      absl::StrCat("The ", std::string(what), " are missing."));
  }
  if (stored_ != nullptr) {
    const auto blob = stored_->find(buffer.upload());
    if (blob != stored_->end()) return Bytes{nullptr, blob->second};
    return wrong_size(what, 0, "what was stored");
  }
  const auto upload = uploads_.find(buffer.upload(), owner_);
  if (!upload.ok()) return upload.status();
  const auto whole = (*upload)->bytes();
  if (!whole.ok()) return whole.status();
  return Bytes{*upload, *whole};
}

absl::StatusOr<SettingsChange> Decoder::settings(const v1::SettingsUpdate& message) {
  SettingsChange change;
  if (message.has_p()) {
    auto p = field(message.p(), "p", &Material::p);
    if (!p.ok()) return p.status();
    change.p = *std::move(p);
  }
  if (message.has_stiffness()) {
    auto stiffness = field(message.stiffness(), "stiffness", &Material::stiffness);
    if (!stiffness.ok()) return stiffness.status();
    change.stiffness = *std::move(stiffness);
  }
  if (message.has_length_unit()) change.length_unit = message.length_unit().length();
  if (message.has_solver()) {
    const auto solver = decode_solver(message.solver());
    if (!solver.ok()) return solver.status();
    change.solver = *solver;
  }
  if (message.has_region()) {
    auto vertices = region(message.region());
    if (!vertices.ok()) return vertices.status();
    change.region = *std::move(vertices);
  }
  return change;
}

absl::StatusOr<Update> Decoder::update(const v1::Update& message) {
  Update update;
  update.input_seq = message.input_seq();
  update.begins_step = message.begins_step();
  if (absl::Status status = handles(message.handles(), update); !status.ok()) return status;
  auto change = settings(message.settings());
  if (!change.ok()) return change.status();
  update.settings = *std::move(change);
  if (message.has_resize()) {
    if (absl::Status status = resize(message.resize(), update); !status.ok()) return status;
  }
  return update;
}

}  // namespace lpdeform
