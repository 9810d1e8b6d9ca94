#include "client/cpp/solve_call.h"

#include <optional>
#include <utility>

#include "client/cpp/frame_assembly.h"
#include "client/cpp/upload.h"
#include "client/cpp/wire.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

absl::Status fill_request(const Lease& lease, const std::optional<NumberedUpdate>& update,
                          const SolveOptions& options, Uploads& uploads, v1::SolveRequest& request) {
  request.set_session(lease.session);
  request.set_writer_token(lease.writer_token);
  request.set_scalar(options.double_precision ? v1::SCALAR_FLOAT64 : v1::SCALAR_FLOAT32);
  request.set_certify(options.certify);
  request.set_trace(options.keep_trace);
  request.set_normals(options.with_normals);
  request.set_progress(static_cast<bool>(options.on_progress));
  Packer packer([&](std::string_view bytes) { return uploads.add(bytes); });
  absl::Status packed;
  if (update) packed.Update(to_wire(update->update, update->seq, packer, *request.mutable_update()));
  if (options.initial_positions) {
    request.mutable_initial_positions()->set_scalar(v1::SCALAR_FLOAT64);
    packed.Update(packer.pack(bytes_of(*options.initial_positions),
                              *request.mutable_initial_positions()->mutable_data()));
  }
  return packed;
}

/// Assembles the result from the messages of a Solve call.
class ResultBuilder {
 public:
  ResultBuilder(std::uint32_t vertex_count, const SolveOptions& options,
                const std::function<void()>& on_solved)
      : assembly_(vertex_count), options_(options), on_solved_(on_solved) {}

  absl::Status take(const v1::SolveResponse& response) {
    switch (response.message_case()) {
      case v1::SolveResponse::kProgress:
        show(response.progress());
        break;
      case v1::SolveResponse::kSummary:
        from_wire(response.summary(), result_);
        on_solved_();
        break;
      case v1::SolveResponse::kTrace:
        for (const auto& record : response.trace().records()) result_.trace.push_back(from_wire(record));
        break;
      case v1::SolveResponse::kFrame:
        return take_part(response.frame());
      default:
        break;  // a heartbeat, or a message that only newer servers send
    }
    return absl::OkStatus();
  }

  absl::StatusOr<SolveResult> finish() && {
    if (is_whole_) return std::move(result_);
    return make_fault({Reason::kFrameParts, "", ""}, "The server's result came without positions.");
  }

 private:
  void show(const v1::SolveProgress& progress) const {
    if (options_.on_progress)
      options_.on_progress({progress.iteration(), progress.energy(), progress.seconds()});
  }

  absl::Status take_part(const v1::FramePart& part) {
    absl::StatusOr<std::optional<Frame>> frame = assembly_.add(part);
    if (!frame.ok()) return frame.status();
    if (!frame->has_value()) return absl::OkStatus();
    result_.positions = std::move((*frame)->positions);
    result_.distortion = std::move((*frame)->distortion);
    result_.normals = std::move((*frame)->normals);
    is_whole_ = true;
    return absl::OkStatus();
  }

  FrameAssembly assembly_;
  const SolveOptions& options_;
  const std::function<void()>& on_solved_;
  SolveResult result_;
  bool is_whole_ = false;
};

}  // namespace

absl::StatusOr<SolveResult> run_solve(Rpc& rpc, const Lease& lease,
                                      const std::optional<NumberedUpdate>& update,
                                      const SolveOptions& options, const std::stop_token& stop,
                                      const std::function<void()>& on_solved) {
  v1::SolveRequest request;
  Uploads uploads(rpc, stop);
  const absl::Status filled = fill_request(lease, update, options, uploads, request);
  if (!filled.ok()) return filled;
  ResultBuilder builder(static_cast<std::uint32_t>(lease.mesh.vertices), options, on_solved);
  const absl::Status ended =
      rpc.solve(request, options.deadline_seconds, stop,
                [&](const v1::SolveResponse& response) { return builder.take(response); });
  uploads.discard();
  if (!ended.ok()) return ended;
  return std::move(builder).finish();
}

}  // namespace lpdeform::client
