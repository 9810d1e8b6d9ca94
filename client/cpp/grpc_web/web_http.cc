#include "client/cpp/grpc_web/web_http.h"

#include <curl/curl.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <mutex>
#include <thread>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#ifdef _WIN32
#include "client/cpp/grpc_web/web_schannel.h"
#else
#include <unistd.h>
#endif

namespace lpdeform::client {
namespace {

/// Time limit of one attempt to connect, with TLS. It is long enough for a busy proxy.
constexpr long kConnectMs = 5000;
/// The thread looks after timeouts at least this often; everything else wakes it.
constexpr int kGlanceMs = 1000;
/// What libcurl's callbacks return to end a request; they are called with one byte or more.
constexpr std::size_t kStop = 0;
/// Connections that are kept for later requests.
constexpr long kMostIdle = 8;

struct Easy {
  void operator()(CURL* handle) const { curl_easy_cleanup(handle); }
};
struct List {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

#ifndef _WIN32
/// The first of these that is there; empty if none is.
std::string first_there(std::initializer_list<const char*> paths) {
  for (const char* const path : paths) {
    if (access(path, R_OK) == 0) return path;
  }
  return "";
}

/// The authorities that the system trusts. Without them, libcurl's own choice stays, if it has one.
void trust_the_system(CURL* easy) {
  const std::string file = first_there({"/etc/ssl/certs/ca-certificates.crt",  // Debian, Arch
                                        "/etc/pki/tls/certs/ca-bundle.crt",    // Fedora
                                        "/etc/ssl/ca-bundle.pem",              // SUSE
                                        "/etc/ssl/cert.pem"});                 // macOS, Alpine
  const std::string folder = first_there({"/system/etc/security/cacerts"});    // Android
  if (!file.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, file.c_str());
  if (!folder.empty()) curl_easy_setopt(easy, CURLOPT_CAPATH, folder.c_str());
}
#endif

std::unique_ptr<curl_slist, List> header_list(const HttpRequest& request) {
  curl_slist* list = curl_slist_append(nullptr, "Expect:");  // no pause before large bodies
  for (const auto& [name, value] : request.headers) {
    list = curl_slist_append(list, absl::StrCat(name, ": ", value).c_str());
  }
  return std::unique_ptr<curl_slist, List>(list);
}

/// One request, on the thread of CurlHttp.
class Exchange {
 public:
  Exchange(HttpRequest request, HttpEvents events)
      : request_(std::move(request)), events_(std::move(events)), headers_(header_list(request_)) {}

  CURL* begin(const std::string& origin, const std::string& socket, const std::optional<Tls>& tls) {
    easy_.reset(curl_easy_init());
    CURL* const easy = easy_.get();
    curl_easy_setopt(easy, CURLOPT_URL, absl::StrCat(origin, request_.path).c_str());
    if (!socket.empty()) curl_easy_setopt(easy, CURLOPT_UNIX_SOCKET_PATH, socket.c_str());
    curl_easy_setopt(easy, CURLOPT_PRIVATE, this);
    curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(easy, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
    curl_easy_setopt(easy, CURLOPT_POST, 1L);
    curl_easy_setopt(easy, CURLOPT_POSTFIELDS, request_.body.data());
    curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request_.body.size()));
    curl_easy_setopt(easy, CURLOPT_HTTPHEADER, headers_.get());
    curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, kConnectMs);
    curl_easy_setopt(easy, CURLOPT_TIMEOUT_MS, static_cast<long>(request_.limit.count()));
    curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, error_);
    curl_easy_setopt(easy, CURLOPT_HEADERDATA, this);
    curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, &Exchange::take_header);
    curl_easy_setopt(easy, CURLOPT_WRITEDATA, this);
    curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, &Exchange::take_bytes);
    // For Schannel, which otherwise refuses certificates that do not say who could revoke them, as self-made ones.
    curl_easy_setopt(easy, CURLOPT_SSL_OPTIONS, static_cast<long>(CURLSSLOPT_REVOKE_BEST_EFFORT));
    if (tls) set_tls(*tls);
    const bool has_own_roots = tls && !tls->root_certificates.empty();  // which libcurl itself looks at
    if (!origin.starts_with("https://") || has_own_roots) return easy;
#ifndef _WIN32
    trust_the_system(easy);
#else
    host_ = host_of(origin);
    curl_easy_setopt(easy, CURLOPT_PREREQDATA, this);
    curl_easy_setopt(easy, CURLOPT_PREREQFUNCTION, &Exchange::check_server);
#endif
    return easy;
  }

  CURL* easy() const {
    return easy_.get();
  }

  void end(CURLcode code) {
    if (code == CURLE_OK) return events_.end(absl::OkStatus());
#ifdef _WIN32
    if (!objection_.empty()) return events_.end(absl::UnavailableError(objection_));
#endif
    const absl::string_view text =
        absl::StripTrailingAsciiWhitespace(error_[0] != '\0' ? error_ : meaning_of(code));
    curl_off_t sent_after = 0;
    if (easy_) curl_easy_getinfo(easy_.get(), CURLINFO_PRETRANSFER_TIME_T, &sent_after);
    if (code == CURLE_OPERATION_TIMEDOUT && sent_after > 0)
      return events_.end(absl::DeadlineExceededError(absl::StrCat("No answer came in time: ", text)));
    events_.end(absl::UnavailableError(text));
  }
  void end_cancelled() {
    events_.end(absl::CancelledError("The call was cancelled."));
  }

 private:
  /// Where libcurl says nothing more, as 8.14 of a certificate for other numeric addresses on Windows.
  static const char* meaning_of(CURLcode code) {
    return code == CURLE_PEER_FAILED_VERIFICATION
               ? "The server's certificate is not trusted, or it is for another host."
               : curl_easy_strerror(code);
  }
  void set_tls(const Tls& tls) {
    set_text(CURLOPT_CAINFO_BLOB, tls.root_certificates);
    set_text(CURLOPT_SSLCERT_BLOB, tls.certificate_chain);
    set_text(CURLOPT_SSLKEY_BLOB, tls.private_key);
    curl_easy_setopt(easy_.get(), CURLOPT_SSLCERTTYPE, "PEM");
  }
  void set_text(CURLoption option, const std::string& text) {
    if (text.empty()) return;
    curl_blob blob{const_cast<char*>(text.data()), text.size(), CURL_BLOB_COPY};
    curl_easy_setopt(easy_.get(), option, &blob);
  }

#ifdef _WIN32
  static std::string host_of(const std::string& origin) {
    const std::size_t start = origin.find("//") + 2;
    std::string host = origin.substr(start, origin.rfind(':') - start);
    return host.front() == '[' ? host.substr(1, host.size() - 2) : host;
  }

  /// Before the request goes out on a connection.
  static int check_server(void* self, char*, char*, int, int) {
    Exchange& exchange = *static_cast<Exchange*>(self);
    long made = 0;
    curl_easy_getinfo(exchange.easy(), CURLINFO_NUM_CONNECTS, &made);
    if (made == 0) return CURL_PREREQFUNC_OK;  // a connection that was looked at before
    curl_tlssessioninfo* tls = nullptr;
    curl_easy_getinfo(exchange.easy(), CURLINFO_TLS_SSL_PTR, &tls);
    exchange.objection_ = tls == nullptr || tls->internals == nullptr
                              ? "There is no TLS to this server."
                              : why_not_trusted(tls->internals, exchange.host_);
    return exchange.objection_.empty() ? CURL_PREREQFUNC_OK : CURL_PREREQFUNC_ABORT;
  }
#endif

  static std::size_t take_header(char* data, std::size_t, std::size_t count, void* self) {
    const absl::string_view line = absl::StripAsciiWhitespace(absl::string_view(data, count));
    const HttpEvents& events = static_cast<Exchange*>(self)->events_;
    Taking taking = Taking::kTaken;
    if (line.substr(0, 5) == "HTTP/") {
      const std::size_t space = line.find(' ');
      taking = events.header(":status", space == line.npos ? "" : std::string(line.substr(space + 1, 3)));
    } else if (const std::size_t colon = line.find(':'); colon != line.npos) {
      taking = events.header(absl::AsciiStrToLower(line.substr(0, colon)),
                             std::string(absl::StripAsciiWhitespace(line.substr(colon + 1))));
    }
    return taking == Taking::kTaken ? count : kStop;
  }

  static std::size_t take_bytes(char* data, std::size_t, std::size_t count, void* self) {
    switch (static_cast<Exchange*>(self)->events_.bytes(std::string_view(data, count))) {
      case Taking::kTaken:
        return count;
      case Taking::kLater:
        return CURL_WRITEFUNC_PAUSE;
      case Taking::kRefused:
        break;
    }
    return kStop;
  }

  const HttpRequest request_;
  const HttpEvents events_;
  std::unique_ptr<CURL, Easy> easy_;
  const std::unique_ptr<curl_slist, List> headers_;
  char error_[CURL_ERROR_SIZE] = "";
#ifdef _WIN32
  std::string host_, objection_;
#endif
};

/// The commands for the thread, which outlive it, because calls may.
class Commands {
 public:
  using Command = std::function<void()>;

  explicit Commands(CURLM* multi) : multi_(multi) {}

  /// Dropped if the thread has ended.
  void add(Command command) {
    const std::scoped_lock lock(mutex_);
    if (multi_ == nullptr) return;
    commands_.push_back(std::move(command));
    curl_multi_wakeup(multi_);
  }
  std::vector<Command> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(commands_, {});
  }
  std::vector<Command> end() {
    const std::scoped_lock lock(mutex_);
    multi_ = nullptr;
    return std::exchange(commands_, {});
  }

 private:
  std::mutex mutex_;
  CURLM* multi_;
  std::vector<Command> commands_;
};

class CurlHttp final : public Http {
 public:
  CurlHttp(std::string origin, std::string socket, std::optional<Tls> tls)
      : origin_(std::move(origin)), socket_(std::move(socket)), tls_(std::move(tls)) {
    curl_multi_setopt(multi_, CURLMOPT_MAXCONNECTS, kMostIdle);
    thread_ = std::thread([this] { run(); });
  }

  ~CurlHttp() override {
    commands_->add([this] { is_over_ = true; });
    thread_.join();
    curl_multi_cleanup(multi_);
  }

  std::shared_ptr<HttpCall> post(HttpRequest request, HttpEvents events) override {
    auto exchange = std::make_shared<Exchange>(std::move(request), std::move(events));
    commands_->add([this, exchange] { begin(exchange); });
    return std::make_shared<Call>(*this, exchange);
  }

 private:
  class Call final : public HttpCall {
   public:
    Call(CurlHttp& http, const std::shared_ptr<Exchange>& exchange)
        : http_(http), commands_(http.commands_), exchange_(exchange) {}
    void cancel() override {
      commands_->add([this_http = &http_, exchange = exchange_.lock()] {
        if (exchange) this_http->cancel(*exchange);
      });
    }
    void resume() override {
      commands_->add([this_http = &http_, exchange = exchange_.lock()] {
        if (exchange && this_http->exchanges_.contains(exchange.get()))
          curl_easy_pause(exchange->easy(), CURLPAUSE_CONT);
      });
    }

   private:
    CurlHttp& http_;  // there for as long as commands_ takes any
    const std::shared_ptr<Commands> commands_;
    const std::weak_ptr<Exchange> exchange_;
  };

  void run() {
    for (;;) {
      for (const Commands::Command& command : commands_->take()) command();
      if (is_over_) break;
      int running = 0;
      curl_multi_perform(multi_, &running);
      end_finished();
      curl_multi_poll(multi_, nullptr, 0, kGlanceMs, nullptr);
    }
    for (const Commands::Command& command : commands_->end()) command();
    while (!exchanges_.empty()) cancel(*exchanges_.begin()->first);
  }

  void begin(const std::shared_ptr<Exchange>& exchange) {
    CURL* const easy = exchange->begin(origin_, socket_, tls_);
    exchanges_.emplace(exchange.get(), exchange);
    curl_multi_add_handle(multi_, easy);
  }

  void cancel(Exchange& exchange) {
    if (const auto kept = forget(exchange)) kept->end_cancelled();
  }

  std::shared_ptr<Exchange> forget(Exchange& exchange) {
    auto node = exchanges_.extract(&exchange);
    if (node.empty()) return nullptr;
    curl_multi_remove_handle(multi_, exchange.easy());
    return std::move(node.mapped());
  }

  void end_finished() {
    int left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi_, &left)) {
      if (message->msg != CURLMSG_DONE) continue;
      Exchange* exchange = nullptr;
      curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &exchange);
      const CURLcode code = message->data.result;
      if (const auto kept = forget(*exchange)) kept->end(code);
    }
  }

  const std::string origin_;
  const std::string socket_;
  const std::optional<Tls> tls_;
  CURLM* const multi_ = curl_multi_init();
  const std::shared_ptr<Commands> commands_ = std::make_shared<Commands>(multi_);
  std::map<Exchange*, std::shared_ptr<Exchange>> exchanges_;  // on the thread
  bool is_over_ = false;                                      // on the thread
  std::thread thread_;
};

}  // namespace

std::shared_ptr<Http> Http::make(std::string origin, std::string socket, std::optional<Tls> tls) {
  static const CURLcode ready = curl_global_init(CURL_GLOBAL_DEFAULT);
  (void)ready;
  return std::make_shared<CurlHttp>(std::move(origin), std::move(socket), std::move(tls));
}

}  // namespace lpdeform::client
