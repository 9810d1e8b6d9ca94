#include "client/python/native/session.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/match.h"
#include "core/base/workers.h"
#include "server/given/surface.h"
#include "server/runtime/random_name.h"

namespace lpdeform::python {
namespace {

/// Timers that can be stopped while sessions hold them.
class StoppableTimers final : public Timers {
 public:
  TimePoint now() const override { return std::chrono::steady_clock::now(); }
  void at(TimePoint when, Action action) override {
    const std::scoped_lock lock(mutex_);
    if (timers_) timers_->at(when, std::move(action));
  }
  void stop() {
    std::unique_ptr<SystemTimers> ended;
    const std::scoped_lock lock(mutex_);
    ended.swap(timers_);
  }

 private:
  std::mutex mutex_;
  std::unique_ptr<SystemTimers> timers_ = std::make_unique<SystemTimers>();
};

/// What the sessions of this process share.
struct Shared {
  const std::shared_ptr<StoppableTimers> timers = std::make_shared<StoppableTimers>();
  const std::shared_ptr<Metrics> metrics = std::make_shared<Metrics>();
  Scheduler scheduler{Scheduler::default_threads()};
  std::vector<std::weak_ptr<Session>> sessions;
};

std::mutex sharing;
Shared* shared = nullptr;  // begun by the first session

SessionServices services() {
  const std::scoped_lock lock(sharing);
  if (shared == nullptr) shared = new Shared;
  return {shared->scheduler, shared->timers, std::chrono::hours(1), shared->metrics, {}};
}

void note(const std::shared_ptr<Session>& session) {
  const std::scoped_lock lock(sharing);
  std::erase_if(shared->sessions, [](const auto& weak) { return weak.expired(); });
  shared->sessions.push_back(session);
}

/// A read-only view of a surface's bytes, which keeps the surface.
template <typename Number>
nb::object view(const std::shared_ptr<const Surface>& surface, std::string_view bytes, std::size_t width) {
  const nb::capsule owner(new std::shared_ptr<const Surface>(surface), [](void* kept) noexcept {
    delete static_cast<std::shared_ptr<const Surface>*>(kept);
  });
  const std::size_t count = bytes.size() / sizeof(Number);
  const auto* const data = reinterpret_cast<const Number*>(bytes.data());
  if (width == 1) return nb::cast(nb::ndarray<nb::numpy, const Number>(data, {count}, owner));
  return nb::cast(nb::ndarray<nb::numpy, const Number>(data, {count / width, width}, owner));
}

void add_arrays(const std::shared_ptr<const Surface>& surface, Format format, bool with_distortion,
                bool with_normals, nb::dict& out) {
  Surface::Bytes bytes;
  {
    const nb::gil_scoped_release released;
    surface->prepare(format, with_normals);
    bytes = surface->bytes(format, 0, surface->vertex_count(), with_distortion, with_normals);
  }
  out["bytes"] = bytes.size();
  if (format == Format::kQuantized) {
    const Quantization& q = surface->quantization();
    out["vertices"] = view<std::uint16_t>(surface, bytes.positions, 4);
    out["quantized_normals"] = view<std::int16_t>(surface, bytes.normals, 4);
    out["origin"] = nb::make_tuple(q.origin.x(), q.origin.y(), q.origin.z());
    out["extent"] = nb::make_tuple(q.extent.x(), q.extent.y(), q.extent.z());
    out["distortion_extent"] = q.distortion_extent;
  } else if (format == Format::kFloat64) {
    out["positions"] = view<double>(surface, bytes.positions, 3);
    out["distortion"] = view<double>(surface, bytes.distortion, 1);
    out["normals"] = view<double>(surface, bytes.normals, 3);
  } else {
    out["positions"] = view<float>(surface, bytes.positions, 3);
    out["distortion"] = view<float>(surface, bytes.distortion, 1);
    out["normals"] = view<float>(surface, bytes.normals, 3);
  }
}

std::string name_of(Method method) {
  return method == Method::kAuto ? "" : std::string(method_name(method));
}

nb::object optional_number(const std::optional<double>& number) {
  return number ? nb::cast(*number) : nb::none();
}

/// A number, or one for each vertex.
nb::object field_of(const std::shared_ptr<const Material>& material) {
  const Field& p = material->p;
  if (p.size() == 1) return nb::cast(p[0]);
  const nb::capsule owner(new std::shared_ptr<const Material>(material), [](void* kept) noexcept {
    delete static_cast<std::shared_ptr<const Material>*>(kept);
  });
  return nb::cast(
      nb::ndarray<nb::numpy, const double>(p.data(), {static_cast<std::size_t>(p.size())}, owner));
}

nb::dict frame_of(const FramePiece& piece) {
  const Frame& frame = *piece.frame;
  nb::dict out;
  out["input_seq"] = frame.input_seq;
  out["frame_seq"] = frame.frame_seq;
  out["epoch"] = frame.epoch;
  out["skipped_inputs"] = piece.skipped_inputs;
  out["iteration"] = frame.iteration;
  out["energy"] = frame.energy;
  out["soft_energy"] = frame.soft_energy;
  out["is_final"] = frame.is_final;
  out["stop_reason"] = std::string(stop_reason_name(frame.stop_reason));
  out["solve_seconds"] = frame.solve_seconds;
  out["method"] = name_of(frame.method);
  out["optimality_gap"] = piece.with_certificate ? optional_number(frame.optimality_gap) : nb::none();
  add_arrays(frame.surface, piece.format, piece.with_distortion, piece.with_normals, out);
  return out;
}

nb::object told(const Note& note) {
  return match(
      note,
      [](const OpenedNote& opened) -> nb::object {
        return nb::make_tuple("opened", opened.epoch, opened.input_seq);
      },
      [](const FramePiece& piece) -> nb::object { return nb::make_tuple("frame", frame_of(piece)); },
      [](const UpdateResult&) -> nb::object { return nb::make_tuple("answer"); },
      [](const FaultNote& fault) -> nb::object {
        return nb::make_tuple("fault", error_of(fault.status), fault.input_seq);
      },
      [](const LoadNote& load) -> nb::object { return nb::make_tuple("load", load.is_overloaded); },
      [](const BetterNote& better) -> nb::object {
        const std::string text =
            absl::StrFormat("A shape with %.3g %% less energy is known.", 100 * better.saved_share);
        return nb::make_tuple("better", text, better.input_seq, better.energy, better.saved_share);
      },
      [](const HeartbeatNote&) -> nb::object { return nb::make_tuple("heartbeat"); },
      [](const EndNote& end) -> nb::object {
        return nb::make_tuple(
            "end", end.reason == EndReason::kWriterReplaced ? "WRITER_REPLACED" : "SESSION_DELETED",
            end.text);
      });
}

}  // namespace

LocalStream::LocalStream(std::shared_ptr<FrameStream> stream) : stream_(std::move(stream)) {
  stream_->start([wakes = wakes_] {
    const std::scoped_lock lock(wakes->mutex);
    wakes->is_woken = true;
    wakes->came.notify_all();
  });
}

std::optional<Note> LocalStream::wait() {
  while (true) {
    {
      std::unique_lock lock(wakes_->mutex);
      if (wakes_->is_stopped) return std::nullopt;
      wakes_->is_woken = false;
    }
    std::optional<Note> note = stream_->next();
    const auto* const piece = note ? std::get_if<FramePiece>(&*note) : nullptr;
    // A frame is taken as a whole. Its last piece says so.
    if (piece != nullptr && !piece->is_last) continue;
    if (note) return note;
    std::unique_lock lock(wakes_->mutex);
    wakes_->came.wait(lock, [&] { return wakes_->is_woken || wakes_->is_stopped; });
  }
}

nb::object LocalStream::next() {
  std::optional<Note> note;
  {
    const nb::gil_scoped_release released;
    note = wait();
  }
  return note ? told(*note) : nb::none();
}

void LocalStream::stop() {
  const std::scoped_lock lock(wakes_->mutex);
  wakes_->is_stopped = true;
  wakes_->came.notify_all();
}

bool LocalJob::wait(double seconds) {
  const nb::gil_scoped_release released;
  std::unique_lock lock(state->mutex);
  return state->changed.wait_for(lock, std::chrono::duration<double>(seconds),
                                 [&] { return state->result.has_value(); });
}

nb::object LocalJob::progress() {
  std::optional<SolveProgress> newest;
  {
    const std::scoped_lock lock(state->mutex);
    newest.swap(state->progress);
  }
  if (!newest) return nb::none();
  return nb::make_tuple(newest->iteration, newest->energy, newest->seconds);
}

nb::object LocalJob::result(bool with_normals) {
  const SolveResult solved = required(*state->result);
  const SolveSummary& summary = solved.summary;
  nb::dict out;
  out["method"] = name_of(summary.method);
  out["stop_reason"] = std::string(stop_reason_name(summary.stop_reason));
  out["iterations"] = summary.iterations;
  out["initial_energy"] = summary.initial_energy;
  out["energy"] = summary.energy;
  out["soft_energy"] = summary.soft_energy;
  out["optimality_gap"] = optional_number(summary.optimality_gap);
  out["setup_seconds"] = summary.setup_seconds;
  out["solve_seconds"] = summary.solve_seconds;
  out["threads"] = summary.threads;
  out["input_seq"] = solved.frame->input_seq;
  out["further_starts"] = summary.further_starts;
  out["search_iterations"] = summary.search_iterations;
  out["effort"] = summary.effort;
  nb::list minima, trace;
  for (const double energy : summary.minima) minima.append(energy);
  for (const IterationRecord& one : summary.trace)
    trace.append(nb::make_tuple(one.iteration, one.seconds, one.energy, one.objective, one.stage));
  out["minima"] = nb::tuple(minima);
  out["trace"] = trace;
  out["p"] = field_of(material);
  add_arrays(solved.frame->surface, Format::kFloat64, true, with_normals, out);
  return out;
}

std::unique_ptr<LocalSession> LocalSession::create(const Numbers3& vertices, const Indices3& faces,
                                                   nb::handle normals, nb::handle weld,
                                                   std::string_view weights, std::string_view free_components,
                                                   nb::handle settings) {
  SessionParts parts;
  parts.name = absl::StrCat("sessions/", random_hex_128());
  parts.free_components = free_components_of(free_components);
  GivenSurface given{.mesh = mesh_of(vertices, faces), .weights = weights_of(weights)};
  if (!normals.is_none()) {
    const auto numbers = nb::cast<Numbers3>(normals);
    require(check_normal_count(numbers.shape(0), static_cast<std::uint32_t>(vertices.shape(0))));
    given.normals = points_of(numbers);
    require(check_normals(given.normals));
  }
  given.weld = weld_of(weld, given.mesh.vertices);
  {
    const nb::gil_scoped_release released;
    const int threads = available_cores();
    require(make_surface(std::move(given), Workers(threads), parts));
    require(make_deformer(threads, {}, parts));
  }
  parts.beginning.settings =
      settings_of(settings, parts.mesh->vertex_count(), *parts.features, parts.mesh->weld().get());
  const nb::gil_scoped_release released;
  auto session = required(Session::create(std::move(parts), services()));
  note(session);
  return std::make_unique<LocalSession>(std::move(session));
}

nb::object LocalSession::report() const {
  const MeshReport report = session_->mesh().report();
  nb::list defects;
  for (const Defect defect : all_defects()) {
    const DefectCount& count = report.of(defect);
    nb::list first;
    for (const std::int32_t index : count.first) first.append(index);
    defects.append(nb::make_tuple(std::string(defect_name(defect)), count.count, nb::tuple(first)));
  }
  return nb::make_tuple(report.vertices, report.faces, report.edges, report.components, report.boundary_loops,
                        defects, session_->mesh().copy_count());
}

nb::object LocalSession::lease() const {
  const WriterLease lease = session_->lease();
  return nb::make_tuple(lease.token, lease.epoch, lease.input_seq);
}

nb::object LocalSession::acquire_writer() {
  WriterLease lease;
  {
    const nb::gil_scoped_release released;
    lease = session_->acquire_writer();
  }
  return nb::make_tuple(lease.token, lease.epoch, lease.input_seq);
}

void LocalSession::update(const std::string& token, nb::handle given, std::uint64_t input_seq) {
  const Update update = update_of(given, input_seq, *session_);
  const nb::gil_scoped_release released;
  require(session_->update(session_->writer(token), update).status());
}

void LocalSession::undo(const std::string& token, std::uint64_t input_seq, bool redo) {
  const nb::gil_scoped_release released;
  require(session_->undo(session_->writer(token), input_seq, redo).status());
}

nb::object LocalSession::take_better(const std::string& token) {
  const BetterNote taken = required(session_->take_better(session_->writer(token)));
  return nb::make_tuple(taken.input_seq, taken.energy);
}

std::unique_ptr<LocalJob> LocalSession::solve(const std::string& token, bool certify, bool trace,
                                              nb::handle positions, bool progress) {
  SolveOptions options{certify, trace, std::nullopt};
  if (!positions.is_none())
    options.initial_positions =
        required(session_->mesh().solver_positions(points_of(nb::cast<Numbers3>(positions))));
  auto local = std::make_unique<LocalJob>();
  SolveJob::OnProgress on_progress;
  if (progress) {
    on_progress = [state = local->state](const SolveProgress& newest) {
      const std::scoped_lock lock(state->mutex);
      state->progress = newest;
    };
  }
  const auto on_done = [state = local->state](absl::StatusOr<SolveResult> result) {
    const std::scoped_lock lock(state->mutex);
    state->result = std::move(result);
    state->changed.notify_all();
  };
  local->job = std::make_shared<SolveJob>(std::move(options), std::move(on_progress), on_done);
  const nb::gil_scoped_release released;
  require(session_->solve(session_->writer(token), std::nullopt, local->job));
  local->material = session_->info().inputs.given_material;
  return local;
}

std::unique_ptr<LocalStream> LocalSession::open_stream(const std::string& token, nb::handle given) {
  const StreamOptions options = stream_options_of(given);
  const nb::gil_scoped_release released;
  std::optional<Session::Writer> writer;
  if (!token.empty()) writer = required(session_->writer(token));
  return std::make_unique<LocalStream>(required(session_->open_stream(writer, options)));
}

void LocalSession::close() {
  session_->close(EndReason::kSessionDeleted, "The session was deleted.");
}

void end_threads() {
  const nb::gil_scoped_release released;
  const std::scoped_lock lock(sharing);
  if (shared == nullptr) return;
  for (const auto& weak : shared->sessions) {
    if (const auto session = weak.lock()) session->close(EndReason::kSessionDeleted, "The process ends.");
  }
  shared->timers->stop();
  delete std::exchange(shared, nullptr);
}

void forget_threads() {
  shared = nullptr;
}

}  // namespace lpdeform::python
