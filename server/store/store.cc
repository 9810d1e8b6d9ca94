#include "server/store/store.h"

#include <openssl/sha.h>

#include <array>

#include "absl/strings/cord.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/refusals.h"

namespace lpdeform {
namespace {

constexpr char kMakeRoom[] = ". Delete sessions, or make room; then try again.";
constexpr char kDamage[] = "lpdeform/damage";      // a payload: what is damaged; stays in this process
constexpr char kAway[] = "lpdeform/store-away";    // a payload: nothing answers; stays in this process
constexpr char kWhere[] = "lpdeform/store-where";  // a payload: a file or an address; stays in this process

absl::Status at(std::string_view where, absl::Status status) {
  if (!where.empty()) status.SetPayload(kWhere, absl::Cord(std::string(where)));
  return status;
}

}  // namespace

std::string blob_key(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest;
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  return absl::BytesToHexString({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

absl::Status store_failing(std::string_view why, std::string_view where) {
  return at(where, make_fault({Reason::kStoreFailing, "store", ""},
                              absl::StrCat("The server's store of sessions fails: ",
                                           absl::string_view(why.data(), why.size()), ".")));
}

absl::Status store_full(std::string_view why, std::string_view limit, std::string_view where) {
  return at(where, make_fault({Reason::kStoreFull, "store", std::string(limit)},
                              absl::StrCat("The server's store of sessions is full: ",
                                           absl::string_view(why.data(), why.size()), kMakeRoom)));
}

std::string text_for_operators(const absl::Status& status) {
  const auto where = status.GetPayload(kWhere);
  const std::string text(status.message());
  return where ? absl::StrCat(text, " (", std::string(*where), ")") : text;
}

absl::Status store_full_at_start(const absl::Status& full, const std::string& folder) {
  const Fault fault = fault_of(full);
  const absl::string_view why = absl::StripSuffix(full.message(), kMakeRoom);
  const std::string what = fault.limit.empty() ? absl::StrCat("Make 20 MiB of room on the disk of ", folder)
                                               : "Raise --max-store-bytes by 20 MiB";
  const auto where = full.GetPayload(kWhere);
  return at(where ? std::string(*where) : "",
            carry_fault(full.code(), fault,
                        absl::StrCat(why, ". ", what, ": the server cannot start until then.")));
}

bool is_full(const absl::Status& status) {
  return fault_of(status).reason == Reason::kStoreFull;
}

absl::Status store_away(std::string_view why, std::string_view where) {
  absl::Status status = store_failing(why, where);
  status.SetPayload(kAway, absl::Cord());
  return status;
}

bool is_away(const absl::Status& status) {
  return status.GetPayload(kAway).has_value();
}

absl::Status session_damaged(std::string_view why, std::string_view where) {
  const absl::string_view text(why.data(), why.size());
  absl::Status status = make_fault({Reason::kSessionDamaged, "session", ""},
                                   absl::StrCat("What is stored of the session cannot be used: ", text, "."));
  status.SetPayload(
      kDamage,
      absl::Cord(where.empty() ? std::string(why)
                               : absl::StrCat(text, ": ", absl::string_view(where.data(), where.size()))));
  return status;
}

absl::Status session_damaged(const absl::Status& why) {
  if (!damage_of(why).empty()) return why;
  const Fault fault = fault_of(why);
  absl::Status status = session_damaged(std::string_view(why.message().data(), why.message().size()));
  status.SetPayload(kDamage,
                    absl::Cord(absl::StrCat("its contents are invalid: ", fault.reason, " ", fault.element)));
  return status;
}

std::string damage_of(const absl::Status& status) {
  const auto damage = status.GetPayload(kDamage);
  return damage ? std::string(*damage) : "";
}

std::string route_header(const std::string& route) {
  return absl::StrCat("lpdeform-session: ", route);
}

absl::Status held_elsewhere(const std::string& route) {
  if (route.empty())
    return session_elsewhere(
        "",
        "try again. The session was created without the header lpdeform-session, so no header leads there.");
  return session_elsewhere(route_header(route),
                           absl::StrCat("call again with the header ", route_header(route), "."));
}

}  // namespace lpdeform
