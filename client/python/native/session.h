#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "client/python/native/values.h"
#include "server/session/session.h"

namespace lpdeform::python {

/// One reader of a session in this process. One thread calls next(); any thread may call the others.
class LocalStream {
 public:
  explicit LocalStream(std::shared_ptr<FrameStream> stream);

  /// Waits for what comes next: a tuple that begins with its kind, "opened", "frame", "fault", "notice", "better" or "end".
  /// None once the stream is stopped.
  nb::object next();
  void acknowledge(std::uint64_t frame_seq) { stream_->acknowledge(frame_seq).IgnoreError(); }
  /// Ends the waiting in next().
  void stop();
  const FrameStream& stream() const { return *stream_; }

 private:
  struct Wakes {
    std::mutex mutex;
    std::condition_variable came;
    bool is_woken = true;
    bool is_stopped = false;
  };
  std::optional<Note> wait();

  const std::shared_ptr<FrameStream> stream_;
  const std::shared_ptr<Wakes> wakes_ = std::make_shared<Wakes>();
};

/// A solve under way.
class LocalJob {
 public:
  /// Waits at most `seconds`; whether the solve is done.
  bool wait(double seconds);
  /// (iteration, energy, seconds) of the newest state that was not asked for yet; otherwise None.
  nb::object progress();
  /// Of a solve that is done: a dictionary, or its error is raised.
  nb::object result(bool with_normals);
  /// Ends the solve within one iteration.
  void abandon() { job->abandon(); }

  struct State {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<SolveProgress> progress;
    std::optional<absl::StatusOr<SolveResult>> result;
  };
  const std::shared_ptr<State> state = std::make_shared<State>();
  std::shared_ptr<SolveJob> job;
  std::shared_ptr<const Material> material;  // whose p is used
};

/// A session in this process: the same Session as in a server, without its calls.
class LocalSession {
 public:
  /// `settings`: of lpdeform.types.Settings.
  static std::unique_ptr<LocalSession> create(const Numbers3& vertices, const Indices3& faces,
                                              nb::handle normals, nb::handle weld, std::string_view weights,
                                              std::string_view free_components, nb::handle settings);
  explicit LocalSession(std::shared_ptr<Session> session) : session_(std::move(session)) {}
  ~LocalSession() { close(); }

  const std::string& name() const { return session_->name(); }
  bool is_closed() const { return session_->is_closed(); }
  nb::object report() const;
  nb::object lease() const;
  std::size_t undo_steps() const { return session_->info().undo_steps; }
  nb::object acquire_writer();
  void update(const std::string& token, nb::handle update, std::uint64_t input_seq);
  void undo(const std::string& token, std::uint64_t input_seq, bool redo);
  nb::object take_better(const std::string& token);
  std::unique_ptr<LocalJob> solve(const std::string& token, bool certify, bool trace, nb::handle positions,
                                  bool progress);
  std::unique_ptr<LocalStream> open_stream(const std::string& token, nb::handle options);
  void forget_stream(const LocalStream& stream) { session_->forget_stream(stream.stream()); }
  void close();

 private:
  const std::shared_ptr<Session> session_;
};

/// Closes all sessions, and ends the threads that they share. Sessions that are made later begin new ones.
void end_threads();
/// In the child of a fork, which has none of the parent's threads.
void forget_threads();

}  // namespace lpdeform::python
