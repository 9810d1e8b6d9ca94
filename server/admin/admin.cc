#include "server/admin/admin.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/access/listener.h"
#include "server/access/local_host.h"
#include "server/admin/http_exchange.h"

namespace lpdeform {
namespace {

/// Limit of connections, those that wait for a page included. More are closed at once.
constexpr std::size_t kMostConnections = 1024;
/// Reserved so that the admin port answers even when gRPC's connections have taken all their descriptors.
constexpr int kSpareDescriptors = 16;

using Asked = std::vector<std::uint64_t>;  // numbers of exchanges
using OnMade = std::function<void(const Asked&, const Admin::Answer&)>;

/// Makes one page. Requests that come while it is being made are answered together by the next run.
class PageMaker {
 public:
  PageMaker(Admin::Page page, OnMade on_made)
      : page_(std::move(page)), on_made_(std::move(on_made)), thread_([this] { run(); }) {}
  ~PageMaker() {
    {
      const std::scoped_lock lock(mutex_);
      is_stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  void ask(std::uint64_t exchange) {
    {
      const std::scoped_lock lock(mutex_);
      asked_.push_back(exchange);
    }
    changed_.notify_all();
  }

 private:
  void run() {
    for (;;) {
      Asked asked;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return is_stopping_ || !asked_.empty(); });
        if (is_stopping_) return;
        asked.swap(asked_);
      }
      on_made_(asked, page_());
    }
  }

  const Admin::Page page_;
  const OnMade on_made_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Asked asked_;
  bool is_stopping_ = false;
  std::thread thread_;  // last, because it uses the other members
};

}  // namespace

struct Admin::Impl {
  using Exchanges = std::map<std::uint64_t, HttpExchange>;  // the oldest first
  struct Made {
    Asked asked;
    Answer answer;
  };

  ~Impl() {
    if (listener) listener->stop();
    {
      const std::scoped_lock lock(mutex);
      is_stopping = true;
    }
    wake();
    if (thread.joinable()) thread.join();
    makers.clear();
    for (const int fd : come) close(fd);
    close(wake_fd);
  }

  void wake() const {
    const std::uint64_t one = 1;
    if (write(wake_fd, &one, sizeof(one)) < 0) return;  // a failure means that the thread is awake already
  }
  void run();
  void wait();
  bool take_news();
  void ask(std::uint64_t number, HttpExchange& exchange);
  void end_slow_ones();

  std::chrono::milliseconds patience{};
  bool is_for_this_machine = false;
  const int wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::unique_ptr<Listener> listener;
  std::mutex mutex;
  std::vector<int> come;   // new connections
  std::vector<Made> made;  // finished pages
  bool is_stopping = false;
  // Used by the thread only:
  Exchanges exchanges;
  std::uint64_t numbers = 0;
  std::thread thread;
  std::map<std::string, std::unique_ptr<PageMaker>> makers;
};

void Admin::Impl::run() {
  while (take_news()) {
    for (auto& [number, exchange] : exchanges) {
      exchange.go_on();
      if (exchange.state() == HttpExchange::State::kAsked) ask(number, exchange);
    }
    end_slow_ones();
    wait();
  }
}

/// Takes new connections and finished pages. Returns false when the thread must end.
bool Admin::Impl::take_news() {
  std::vector<int> connections;
  std::vector<Made> pages;
  {
    const std::scoped_lock lock(mutex);
    if (is_stopping) return false;
    connections.swap(come);
    pages.swap(made);
  }
  for (const int fd : connections) exchanges.try_emplace(++numbers, fd, patience);
  for (const Made& page : pages) {
    for (const std::uint64_t number : page.asked) {
      const auto exchange = exchanges.find(number);
      if (exchange != exchanges.end())
        exchange->second.answer(page.answer.status, page.answer.content_type, page.answer.body);
    }
  }
  return true;
}

void Admin::Impl::ask(std::uint64_t number, HttpExchange& exchange) {
  if (is_for_this_machine && exchange.host() && !names_this_machine(*exchange.host())) {
    return exchange.answer(403, "text/plain",
                           "The admin port must be called localhost, 127.0.0.1 or [::1].\n");
  }
  const auto maker = makers.find(exchange.path());
  if (maker == makers.end()) return exchange.answer(404, "text/plain", "");
  exchange.wait();
  maker->second->ask(number);
}

/// Ends exchanges that are over, those whose time is up, and the oldest ones if there are too many.
void Admin::Impl::end_slow_ones() {
  const auto now = HttpExchange::Clock::now();
  std::erase_if(exchanges, [&](const auto& one) {
    return one.second.state() == HttpExchange::State::kOver || one.second.until() <= now;
  });
  const auto is_patient = [](const auto& one) { return one.second.is_waited_for(); };
  auto patient = std::count_if(exchanges.begin(), exchanges.end(), is_patient);
  for (auto one = exchanges.begin(); patient > static_cast<std::ptrdiff_t>(kMostPatient);) {
    const bool goes = is_patient(*one);
    one = goes ? exchanges.erase(one) : std::next(one);
    patient -= goes ? 1 : 0;
  }
}

void Admin::Impl::wait() {
  std::vector<pollfd> waited_for{{wake_fd, POLLIN, 0}};
  auto until = HttpExchange::Clock::time_point::max();
  for (const auto& [number, exchange] : exchanges) {
    if (exchange.events() == 0) continue;
    waited_for.push_back({exchange.fd(), exchange.events(), 0});
    until = std::min(until, exchange.until());
  }
  int timeout_ms = -1;
  if (until != HttpExchange::Clock::time_point::max()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - HttpExchange::Clock::now());
    timeout_ms = static_cast<int>(std::max<std::int64_t>(0, left.count()));
  }
  poll(waited_for.data(), waited_for.size(), timeout_ms);
  std::uint64_t news = 0;
  if (read(wake_fd, &news, sizeof(news)) < 0) return;  // nothing woke the thread
}

absl::StatusOr<std::unique_ptr<Admin>> Admin::start(const std::string& address,
                                                    const std::map<std::string, Page>& pages,
                                                    std::chrono::milliseconds patience) {
  auto listener = Listener::bind(address);
  if (!listener.ok()) {
    return make_fault(
        {Reason::kAddressNotBound, address, ""},
        absl::StrCat("The admin port cannot be opened. ", absl::string_view(listener.status().message())));
  }
  auto impl = std::make_unique<Impl>();
  impl->patience = patience;
  impl->listener = *std::move(listener);
  impl->is_for_this_machine = impl->listener->is_local();
  Impl* const self = impl.get();
  for (const auto& [path, page] : pages) {
    impl->makers[path] = std::make_unique<PageMaker>(page, [self](const Asked& asked, const Answer& answer) {
      {
        const std::scoped_lock lock(self->mutex);
        self->made.push_back({asked, answer});
      }
      self->wake();
    });
  }
  impl->thread = std::thread([self] { self->run(); });
  Listener::Events events;
  events.on_connection = [self](int, int fd) {
    {
      const std::scoped_lock lock(self->mutex);
      self->come.push_back(fd);
    }
    self->wake();
  };
  events.on_refused = [] {};
  impl->listener->start({kMostConnections, 0, kSpareDescriptors}, std::move(events));
  return std::unique_ptr<Admin>(new Admin(std::move(impl)));
}

Admin::Admin(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Admin::~Admin() = default;

const std::string& Admin::address() const {
  return impl_->listener->address();
}

}  // namespace lpdeform
