#include "server/calls/session_factory.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/base/workers.h"
#include "server/given/surface.h"
#include "server/runtime/random_name.h"

namespace lpdeform {
namespace {

constexpr std::uint32_t kFacesPerVertex = 3;

/// The estimate of a session's memory until the true value is known: about what a triangulated surface needs,
/// with its factor.
constexpr std::size_t kBytesPerVertex = 2600, kBytesPerFace = 100;

std::size_t estimate(const v1::Mesh& mesh) {
  return kBytesPerVertex * mesh.vertex_count() + kBytesPerFace * mesh.face_count();
}

/// Makes the shape, and the mesh that clients draw.
absl::Status make_mesh(const v1::CreateSessionRequest& request, Decoder& decoder, const Workers& workers,
                       SessionParts& parts) {
  const auto weights = decode_weights(request.weights());
  if (!weights.ok()) return weights.status();
  auto mesh = decoder.mesh(request.mesh());
  if (!mesh.ok()) return mesh.status();
  auto normals = decoder.normals(request.normals());
  if (!normals.ok()) return normals.status();
  const auto weld = decoder.weld(request.weld(), mesh->vertices);
  if (!weld.ok()) return weld.status();
  return make_surface({*std::move(mesh), *std::move(normals), *weld, *weights}, workers, parts);
}

}  // namespace

SessionFactory::SessionFactory(const ServerOptions& options, std::shared_ptr<Budget> budget,
                               std::shared_ptr<Uploads> uploads, SessionServices services)
    : options_(options),
      budget_(std::move(budget)),
      uploads_(std::move(uploads)),
      services_(std::move(services)) {}

int SessionFactory::threads() const {
  return options_.threads == 0 ? available_cores() : options_.threads;
}

Decoder SessionFactory::decoder(const v1::CreateSessionRequest& request, const std::string& owner) const {
  return {*uploads_, request.mesh().vertex_count(), nullptr, nullptr, owner};
}

/// Makes everything that depends on the request's mesh.
absl::Status SessionFactory::make_shape(const v1::CreateSessionRequest& request, Decoder decoder,
                                        SessionParts& parts) const {
  const auto free_components = decode_free_components(request.free_components());
  if (!free_components.ok()) return free_components.status();
  auto memory = budget_->reserve(estimate(request.mesh()), parts.owner);
  if (!memory.ok()) return memory.status();
  parts.free_components = *free_components;
  parts.memory = *std::move(memory);
  if (absl::Status status = make_mesh(request, decoder, Workers(threads()), parts); !status.ok())
    return status;
  const std::size_t held = parts.shape->memory_bytes() + parts.mesh->memory_bytes();
  const auto admit = [&parts, held](std::size_t bytes) { return parts.memory.grow_to(held + bytes); };
  return make_deformer(threads(), admit, parts);
}

/// `surface`: the present positions of the client's vertices.
absl::StatusOr<std::shared_ptr<Session>> SessionFactory::finish(SessionParts parts,
                                                                const std::optional<Points>& surface) const {
  if (surface) {
    const auto positions = parts.mesh->solver_positions(*surface);
    if (!positions.ok()) return positions.status();
    if (absl::Status status = parts.deformer->set_positions(*positions); !status.ok()) return status;
    parts.has_surface = true;
  }
  return Session::create(std::move(parts), services_);
}

absl::StatusOr<std::shared_ptr<Session>> SessionFactory::make(const SessionMaker& maker,
                                                              const v1::CreateSessionRequest& request) const {
  Decoder mesh_decoder = decoder(request, maker.owner);
  const std::uint32_t most_faces = kFacesPerVertex * options_.max_vertices;
  absl::Status status = mesh_decoder.check_mesh_size(request.mesh(), {options_.max_vertices, most_faces});
  if (!status.ok()) return status;
  SessionParts parts;
  parts.name = absl::StrCat("sessions/", random_hex_128());
  parts.owner = maker.owner;
  parts.route = maker.route;
  status = make_shape(request, mesh_decoder, parts);
  if (!status.ok()) return status;
  Decoder inputs(*uploads_, request.mesh().vertex_count(), parts.features.get(), parts.mesh->weld().get(),
                 maker.owner);
  status = inputs.handles(request.handles(), parts.beginning);
  if (!status.ok()) return status;
  auto settings = inputs.settings(request.settings());
  if (!settings.ok()) return settings.status();
  parts.beginning.settings = *std::move(settings);
  return finish(std::move(parts));
}

absl::StatusOr<std::shared_ptr<Session>> SessionFactory::make_from(const SessionMaker& maker,
                                                                   const Snapshot& snapshot) const {
  static const StoredBlobs no_blobs;
  const v1::CreateSessionRequest& request = snapshot.request;
  Decoder decoder = this->decoder(request, maker.owner).reading_stored(no_blobs);
  const std::uint32_t most_faces = kFacesPerVertex * options_.max_vertices;
  absl::Status status = decoder.check_mesh_size(request.mesh(), {options_.max_vertices, most_faces});
  if (!status.ok()) return status;
  std::optional<Points> surface;
  if (snapshot.surface) {
    auto positions = decoder.positions(*snapshot.surface);
    if (!positions.ok()) return positions.status();
    surface = *std::move(positions);
  }
  SessionParts parts;
  parts.name = absl::StrCat("sessions/", random_hex_128());
  parts.owner = maker.owner;
  parts.route = maker.route;
  status = take_state(maker.owner, snapshot, parts);
  if (status.ok()) status = make_shape(request, decoder, parts);
  return status.ok() ? finish(std::move(parts), surface) : status;
}

/// Takes the snapshot's handles and settings, with a new writer.
absl::Status SessionFactory::take_state(const std::string& owner, const Snapshot& snapshot,
                                        SessionParts& parts) const {
  StoredSession stored{.owner = owner, .epoch = 1, .parts = snapshot.parts};
  stored.parts["writer"] = encode_writer(random_hex_128());
  auto state = decode_state(stored, {snapshot.request, 0, 0}, *uploads_);
  if (!state.ok()) return snapshot_damaged(std::string(state.status().message()));
  parts.beginning = std::move(state->state);
  parts.past = std::move(state->past);
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<Session>> SessionFactory::make_again(const std::string& name,
                                                                    const StoredSession& stored,
                                                                    const SessionHead& head,
                                                                    const StoredBlobs& blobs) const {
  auto state = decode_state(stored, head, *uploads_);
  if (!state.ok()) return state.status();
  SessionParts parts;
  parts.name = name;
  parts.owner = stored.owner;
  parts.route = stored.route;
  parts.beginning = std::move(state->state);
  parts.past = std::move(state->past);
  const Decoder mesh_decoder = decoder(head.request, stored.owner).reading_stored(blobs);
  const absl::Status made = make_shape(head.request, mesh_decoder, parts);
  auto session = made.ok() ? finish(std::move(parts)) : made;
  // An earlier version, or one with another ordering, may have taken a mesh whose factorisation is too long for this one.
  if (fault_of(session.status()).reason == Reason::kFactorTooLarge) return session;
  // The rest of the state was valid when it was saved, so an error here means damage.
  if (absl::IsInvalidArgument(session.status()) || absl::IsFailedPrecondition(session.status()))
    return session_damaged(session.status());
  return session;
}

}  // namespace lpdeform
