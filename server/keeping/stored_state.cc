#include "server/keeping/stored_state.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/keeping/encode_stored.h"
#include "server/keeping/stored.pb.h"
#include "server/wire/encode.h"

namespace lpdeform {
namespace {

constexpr const char* kGroup = "g:";
constexpr const char* kMovement = "m:";
constexpr const char* kStep = "s:";
constexpr std::uint64_t kMostSteps = 10'000;  // more than a flag allows
constexpr std::string_view kBlob = "blobs/";

/// Deterministic: the same message gives the same bytes.
std::string bytes_of(const google::protobuf::Message& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  static_cast<void>(message.SerializeToCodedStream(&coded));  // fails from 2 GiB on, which limits exclude
  coded.Trim();
  return bytes;
}

void put_apart(v1::Buffer& buffer, std::string bytes, StoredHead& head) {
  const std::string key = blob_key(bytes);
  buffer.set_upload(absl::StrCat(absl::string_view(kBlob.data(), kBlob.size()), key));
  head.blobs[key] = std::move(bytes);
}

std::vector<v1::Buffer*> large_buffers(v1::CreateSessionRequest& request) {
  std::vector<v1::Buffer*> buffers{request.mutable_mesh()->mutable_data()};
  if (request.weld().has_groups()) buffers.push_back(request.mutable_weld()->mutable_groups());
  if (request.normals().has_data()) buffers.push_back(request.mutable_normals()->mutable_data());
  return buffers;
}

std::string encode_inputs(const SessionChanges& changes) {
  const InputAges& ages = changes.inputs.ages;
  stored::Inputs message;
  message.set_input_seq(changes.lease.input_seq);
  message.set_p_seq(ages.p);
  message.set_stiffness_seq(ages.stiffness);
  message.set_length_unit_seq(ages.length_unit);
  message.set_solver_seq(ages.solver);
  message.set_region_seq(ages.region);
  message.set_forgotten_seq(ages.forgotten);
  message.set_history_first(changes.inputs.history.first);
  message.set_history_undo_steps(changes.inputs.history.undo_steps);
  message.set_history_steps(changes.inputs.history.steps);
  message.set_is_undo(changes.inputs.is_undo);
  message.set_is_redo(changes.inputs.is_redo);
  message.mutable_length_unit()->set_length(changes.inputs.inputs.given_material->length_unit);
  encode_solver(changes.inputs.inputs.solver, *message.mutable_solver());
  return bytes_of(message);
}

std::string encode_removals(const InputChanges& inputs) {
  stored::Removals message;
  for (const auto& [name, age] : inputs.ages.handles) {
    if (!inputs.inputs.given_handles->handles().contains(name)) (*message.mutable_input_seqs())[name] = age;
  }
  return bytes_of(message);
}

std::uint64_t age_of(const InputAges& ages, const std::string& handle) {
  const auto age = ages.handles.find(handle);
  return age == ages.handles.end() ? 0 : age->second;
}

template <typename Message>
absl::StatusOr<Message> read_part(const std::map<std::string, std::string>& parts, const std::string& name) {
  Message message;
  const auto part = parts.find(name);
  if (part != parts.end() && message.ParseFromString(part->second)) return message;
  const bool is_of_handle = absl::StartsWith(name, kGroup) || absl::StartsWith(name, kMovement);
  return session_damaged(absl::StrCat("its part ", is_of_handle ? name.substr(0, 1) : name,
                                      part == parts.end() ? " is missing" : " cannot be read"));
}

absl::Status read_settings(const std::map<std::string, std::string>& parts, const stored::Inputs& inputs,
                           v1::SettingsUpdate& out) {
  *out.mutable_length_unit() = inputs.length_unit();
  *out.mutable_solver() = inputs.solver();
  const auto p = read_part<v1::Field>(parts, "p");
  const auto stiffness = read_part<v1::Field>(parts, "stiffness");
  if (!p.ok()) return p.status();
  if (!stiffness.ok()) return stiffness.status();
  *out.mutable_p() = *p;
  *out.mutable_stiffness() = *stiffness;
  if (!parts.contains("region")) return absl::OkStatus();
  const auto region = read_part<v1::RegionOfInterest>(parts, "region");
  if (region.ok()) *out.mutable_region() = *region;
  return region.status();
}

InputAges read_ages(const stored::Inputs& inputs) {
  InputAges ages;
  ages.p = inputs.p_seq();
  ages.stiffness = inputs.stiffness_seq();
  ages.length_unit = inputs.length_unit_seq();
  ages.solver = inputs.solver_seq();
  ages.region = inputs.region_seq();
  ages.forgotten = inputs.forgotten_seq();
  return ages;
}

/// Reads the steps that can be undone and redone.
absl::Status read_history(const std::map<std::string, std::string>& parts, const stored::Inputs& inputs,
                          const Decoder& decoder, InputHistory& out) {
  if (inputs.history_steps() > kMostSteps) return session_damaged("its history is too long");
  out.first = inputs.history_first();
  out.undo_steps = inputs.history_undo_steps();
  out.is_undo = inputs.is_undo();
  out.is_redo = inputs.is_redo();
  for (std::uint64_t k = 0; k < inputs.history_steps(); ++k) {
    const auto step = read_part<stored::Step>(parts, absl::StrCat(kStep, out.first + k));
    if (!step.ok()) return step.status();
    Update update;
    absl::Status status = Decoder(decoder).handles(step->changes(), update);
    if (!status.ok()) return session_damaged(status);
    out.steps.push_back(std::move(update.handles));
  }
  return absl::OkStatus();
}

/// Reads one handle and its age.
absl::Status read_handle(const std::map<std::string, std::string>& parts, const std::string& name,
                         Decoder decoder, SessionState& out) {
  const auto group = read_part<stored::Group>(parts, kGroup + name);
  if (!group.ok()) return group.status();
  const auto movement = read_part<stored::Movement>(parts, kMovement + name);
  if (!movement.ok()) return movement.status();
  google::protobuf::RepeatedPtrField<v1::HandleUpdate> updates;
  v1::HandleUpdate& update = *updates.Add();
  update.set_name(name);
  *update.mutable_set() = group->handle();
  *update.mutable_set()->mutable_motion() = movement->motion();
  out.past.ages.handles[name] = movement->input_seq();
  return decoder.handles(updates, out.state);
}

}  // namespace

absl::StatusOr<StoredHead> encode_head(const v1::CreateSessionRequest& request, Decoder& decoder,
                                       std::uint64_t fingerprint, std::int64_t created_unix_ms) {
  stored::Head head;
  StoredHead out;
  v1::CreateSessionRequest& kept = *head.mutable_request();
  kept = request;
  kept.clear_settings();
  kept.clear_handles();
  for (v1::Buffer* const buffer : large_buffers(kept)) {
    auto bytes = decoder.raw(*buffer, "mesh data");
    if (!bytes.ok()) return bytes.status();
    put_apart(*buffer, *std::move(bytes), out);
  }
  head.set_fingerprint(fingerprint);
  head.set_created_unix_ms(created_unix_ms);
  out.part = bytes_of(head);
  return out;
}

absl::StatusOr<StoredHead> encode_head_again(const Session& session, const std::string& part) {
  stored::Head head;
  if (!head.ParseFromString(part)) return session_damaged("its part \"head\" cannot be read");
  StoredHead out;
  v1::CreateSessionRequest& kept = *head.mutable_request();
  kept.clear_mesh();
  kept.clear_weld();
  kept.clear_normals();
  encode_mesh(session.info(), kept);
  for (v1::Buffer* const buffer : large_buffers(kept)) {
    std::string bytes = std::move(*buffer->mutable_inline_());
    put_apart(*buffer, std::move(bytes), out);
  }
  out.part = bytes_of(head);
  return out;
}

std::string encode_writer(const std::string& token) {
  stored::Writer writer;
  writer.set_token(token);
  return bytes_of(writer);
}

StoredParts encode_changes(const SessionChanges& changes) {
  const InputChanges& inputs = changes.inputs;
  const Material& material = *inputs.inputs.given_material;
  StoredParts parts;
  parts["writer"] = encode_writer(changes.lease.token);
  parts["inputs"] = encode_inputs(changes);
  if (inputs.has_p) parts["p"] = bytes_of(encode_whole_field(material.p));
  if (inputs.has_stiffness) parts["stiffness"] = bytes_of(encode_whole_field(material.stiffness));
  if (inputs.has_region) {
    const std::vector<std::int32_t>* const region = inputs.inputs.given_handles->region();
    parts["region"] = region == nullptr ? std::nullopt : std::optional(bytes_of(encode_region(*region)));
  }
  const auto& handles = inputs.inputs.given_handles->handles();
  for (const std::string& name : inputs.regrouped) {
    stored::Group group;
    encode_group(handles.find(name)->second, *group.mutable_handle());
    parts[kGroup + name] = bytes_of(group);
  }
  for (const std::string& name : inputs.moved) {
    stored::Movement movement;
    movement.set_input_seq(age_of(inputs.ages, name));
    encode_motion(handles.find(name)->second.motion, *movement.mutable_motion());
    parts[kMovement + name] = bytes_of(movement);
  }
  for (const std::string& name : inputs.removed) {
    parts[kGroup + name] = std::nullopt;
    parts[kMovement + name] = std::nullopt;
  }
  for (const std::uint64_t number : inputs.steps.dropped) parts[absl::StrCat(kStep, number)] = std::nullopt;
  for (const auto& [number, step] : inputs.steps.steps) {
    stored::Step message;
    for (const HandleChange& change : step) encode_change(change, *message.add_changes());
    parts[absl::StrCat(kStep, number)] = bytes_of(message);
  }
  // A handle that is set may have been removed before.
  if (inputs.is_all || !inputs.removed.empty() || !inputs.regrouped.empty())
    parts["removed"] = encode_removals(inputs);
  return parts;
}

absl::StatusOr<SessionHead> decode_head(const std::map<std::string, std::string>& parts) {
  auto head = read_part<stored::Head>(parts, "head");
  if (!head.ok()) return head.status();
  return SessionHead{std::move(*head->mutable_request()), head->fingerprint(), head->created_unix_ms()};
}

const google::protobuf::Descriptor* part_type(std::string_view name) {
  if (name.starts_with(kGroup)) return stored::Group::descriptor();
  if (name.starts_with(kMovement)) return stored::Movement::descriptor();
  if (name.starts_with(kStep)) return stored::Step::descriptor();
  if (name == "inputs") return stored::Inputs::descriptor();
  if (name == "removed") return stored::Removals::descriptor();
  if (name == "p" || name == "stiffness") return v1::Field::descriptor();
  return name == "region" ? v1::RegionOfInterest::descriptor() : nullptr;
}

std::vector<std::string> blobs_of(const v1::CreateSessionRequest& head) {
  v1::CreateSessionRequest request = head;
  std::vector<std::string> keys;
  for (const v1::Buffer* const buffer : large_buffers(request)) {
    if (absl::StartsWith(buffer->upload(), absl::string_view(kBlob.data(), kBlob.size())))
      keys.push_back(buffer->upload().substr(kBlob.size()));
  }
  return keys;
}

absl::StatusOr<SessionState> decode_state(const StoredSession& stored, const SessionHead& head,
                                          Uploads& uploads) {
  const auto writer = read_part<stored::Writer>(stored.parts, "writer");
  const auto inputs = read_part<stored::Inputs>(stored.parts, "inputs");
  const auto removals = read_part<stored::Removals>(stored.parts, "removed");
  for (const absl::Status& status : {writer.status(), inputs.status(), removals.status()}) {
    if (!status.ok()) return status;
  }
  SessionState out;
  out.past = {writer->token(), stored.epoch, head.created_unix_ms, read_ages(*inputs)};
  for (const auto& [name, age] : removals->input_seqs()) out.past.ages.handles[name] = age;

  static const StoredBlobs no_blobs;
  const Decoder decoder = Decoder(uploads, head.request.mesh().vertex_count()).reading_stored(no_blobs);
  v1::SettingsUpdate settings;
  absl::Status status = read_settings(stored.parts, *inputs, settings);
  if (!status.ok()) return status;
  auto decoded = Decoder(decoder).settings(settings);
  if (!decoded.ok()) return session_damaged(decoded.status());
  out.state.settings = *std::move(decoded);
  out.state.input_seq = inputs->input_seq();
  for (const auto& [part, bytes] : stored.parts) {
    if (!absl::StartsWith(part, kGroup)) continue;
    status = read_handle(stored.parts, part.substr(2), decoder, out);
    if (!status.ok()) return session_damaged(status);
  }
  status = read_history(stored.parts, *inputs, decoder, out.past.history);
  if (!status.ok()) return status;
  return out;
}

std::uint64_t fingerprint_of(const google::protobuf::Message& request) {
  const std::string digest = blob_key(bytes_of(request));
  return std::stoull(digest.substr(0, 16), nullptr, 16);
}

}  // namespace lpdeform
