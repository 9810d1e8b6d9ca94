#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>

#include "server/admin/health_probe.h"
#include "server/command_line.h"
#include "server/flags.h"
#include "server/process_end.h"
#include "server/server.h"
#include "server/store/open_store.h"

namespace {

using lpdeform::Arguments;
using lpdeform::ServerOptions;

/// The exit statuses other than 0.
constexpr int kRefused = 1, kNotKept = 2;

/// How long the process may take to end by itself after it has waited for the store. It is less if the store
/// hangs, because nothing can be saved any more.
constexpr std::chrono::seconds kToEnd{10}, kToEndWithout{2};

constexpr char kDescription[] =
    "Deforms triangle meshes as a gRPC service (lpdeform.v1). Each option can also be set by the environment "
    "variable beside it. SIGTERM or SIGINT stops the server. Exit status: 0 stopped; 1 did not start; "
    "2 stopped, but the store lacks answered updates (the log names the sessions).";

int refuse(const absl::Status& why) {
  std::fprintf(stderr, "lpdeform-server: %s\n", lpdeform::text_for_operators(why).c_str());
  return kRefused;
}

/// A request for help ends with status 0; anything else is an error.
int end_of_parse(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  std::fprintf(stderr, "lpdeform-server: %s (see lpdeform-server --help)\n", error.what());
  return kRefused;
}

int serve(Arguments& arguments, const sigset_t& signals, lpdeform::ProcessEnd& end) {
  ServerOptions& options = arguments.server;
  options.log = std::make_shared<lpdeform::Log>(arguments.log_level);
  auto store = lpdeform::open_store(arguments.store, arguments.store_options);
  if (!store.ok()) return refuse(store.status());
  options.store = *std::move(store);
  const auto server = lpdeform::Server::start(options);
  if (!server.ok()) return refuse(server.status());
  std::printf("lpdeform-server listens on %s\n", (*server)->address().c_str());
  if (!(*server)->admin_address().empty()) {
    std::printf("lpdeform-server serves its admin pages on http://%s\n", (*server)->admin_address().c_str());
  }
  std::fflush(stdout);
  int signal = 0;
  sigwait(&signals, &signal);
  const auto status = [](bool is_all_kept) { return is_all_kept ? 0 : kNotKept; };
  return status((*server)->drain(arguments.grace, [&](bool is_all_kept) {
    end.within(is_all_kept ? kToEnd : kToEndWithout, status(is_all_kept), options.log);
  }));
}

const pthread_t main_thread = pthread_self();

void pass_to_main_thread(int signal) {
  pthread_kill(main_thread, signal);
}

// Leaves SIGTERM and SIGINT to sigwait() in the main thread. Threads made from now on block both signals.
// Threads that a library (OpenBLAS) made while it was loaded do not, and they pass the signals on.
sigset_t signals_for_sigwait() {
  sigset_t signals;
  sigemptyset(&signals);
  struct sigaction pass_on = {};
  pass_on.sa_handler = pass_to_main_thread;
  for (const int signal : {SIGTERM, SIGINT}) {
    sigaddset(&signals, signal);
    sigaction(signal, &pass_on, nullptr);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

}  // namespace

int main(int argc, char** argv) {
  const sigset_t signals = signals_for_sigwait();
  // Writing beyond a limit on file size then fails, instead of ending the process.
  signal(SIGXFSZ, SIG_IGN);

  lpdeform::ProcessEnd end;  // outlives the store
  Arguments arguments;
  CLI::App app;
  app.description(kDescription);
  lpdeform::add_flags(app, lpdeform::flags_of(arguments));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return end_of_parse(app, error);
  }
  if (!arguments.probed.empty()) return lpdeform::is_serving(arguments.probed) ? 0 : 1;
  return serve(arguments, signals, end);
}
