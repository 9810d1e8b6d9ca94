#include "client/c/options.h"

#include <chrono>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "client/c/structs.h"
#include "client/cpp/tls_texts.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {
namespace {

std::chrono::milliseconds milliseconds(double seconds, double otherwise) {
  return std::chrono::milliseconds(std::llround(1000 * (seconds > 0 ? seconds : otherwise)));
}

std::string text(const char* from) {
  return from == nullptr ? std::string() : std::string(from);
}

}  // namespace

absl::Status check_seconds(const char* name, double seconds) {
  if (std::isfinite(seconds) && seconds >= 0 && seconds <= 1e9) return absl::OkStatus();
  return make_fault({Reason::kSecondsOutOfRange, name, absl::StrCat("0 <= ", name, " <= 1e9")},
                    absl::StrCat(name, " is ", seconds, "."));
}

absl::StatusOr<std::shared_ptr<Server>> make_server(const lpdeform_connection& given) {
  if (given.address == nullptr) return argument_missing("connection.address");
  absl::Status checked = check_seconds("connect_timeout_seconds", given.connect_timeout_seconds);
  checked.Update(check_seconds("call_timeout_seconds", given.call_timeout_seconds));
  checked.Update(check_seconds("reconnect_seconds", given.reconnect_seconds));
  if (!checked.ok()) return checked;
  const client::Tls tls{text(given.root_certificates), text(given.certificate_chain),
                        text(given.private_key)};
  const bool has_texts =
      !tls.root_certificates.empty() || !tls.certificate_chain.empty() || !tls.private_key.empty();
  if (given.tls == 0 && has_texts) {
    return make_fault({Reason::kTlsOff, "connection.tls", "tls = 1"},
                      "There are certificates, but tls is 0.");
  }
  client::ClientOptions options;
  options.connect_timeout = milliseconds(given.connect_timeout_seconds, 5);
  options.call_timeout = milliseconds(given.call_timeout_seconds, 30);
  options.reconnect_for = milliseconds(given.reconnect_seconds, 1e9);
  if (given.tls != 0) {
    options.tls = tls;
    checked.Update(client::check_tls(tls));
    if (!checked.ok()) return checked;
  }
  auto server = std::make_shared<Server>(given.address, std::move(options), given.reconnect_seconds);
  const absl::Status has_token = server->set_token(text(given.token));
  if (!has_token.ok()) return has_token;
  return server;
}

absl::StatusOr<ReadOptions> read_options(const lpdeform_options* options) {
  lpdeform_options defaults{};
  defaults.struct_size = sizeof defaults;
  const auto given = read_struct(options == nullptr ? &defaults : options, "options");
  if (!given.ok()) return given.status();
  absl::Status checked = check_enum("weights", given->weights, LPDEFORM_INTRINSIC_DELAUNAY);
  checked.Update(check_enum("free_components", given->free_components, LPDEFORM_FREE_COMPONENTS_FOLLOW));
  checked.Update(check_enum("encoding", given->encoding, LPDEFORM_ENCODING_COMPRESSED));
  checked.Update(check_reserved("options", given->reserved));
  checked.Update(check_enum("lowest_encoding", given->lowest_encoding, LPDEFORM_ENCODING_COMPRESSED));
  if (!checked.ok()) return checked;
  const auto space = Space::of(*given);
  if (!space.ok()) return space.status();
  ReadOptions out;
  out.open.weights = static_cast<client::WeightKind>(given->weights);
  out.open.free_components = static_cast<client::FreeComponents>(given->free_components);
  out.open.credit = given->credit;
  out.open.double_precision = given->double_precision != 0;
  out.open.encoding = static_cast<client::Encoding>(given->encoding);
  out.open.lowest_encoding = static_cast<client::Encoding>(given->lowest_encoding);
  out.open.without_distortion = given->without_distortion != 0;
  out.open.with_normals = given->with_normals != 0;
  out.open.certify = given->certify != 0;
  out.open.max_frames_per_second = given->max_frames_per_second;
  out.facts.space = *space;
  out.facts.contents = {
      .normals = out.open.with_normals,
      .distortion = !out.open.without_distortion || out.open.encoding != client::Encoding::kRaw};
  return out;
}

}  // namespace lpdeform::engine
