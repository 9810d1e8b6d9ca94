#include "server/access/transport_security.h"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

#include <string>
#include <utility>

#include "core/base/check.h"

namespace lpdeform {
namespace {

/// gRPC asks for the contents in force before each handshake. Its C++ interface offers this only for files,
/// which it does not check: if they are damaged, it accepts no connection.
class FreshCredentials final : public grpc::ServerCredentials {
 public:
#ifdef LPDEFORM_GRPC_HOLDS_CREDENTIALS
  explicit FreshCredentials(std::shared_ptr<Certificates> certificates)
      : grpc::ServerCredentials(create(certificates->knows_clients(), this)),
        certificates_(std::move(certificates)) {}
#else
  explicit FreshCredentials(std::shared_ptr<Certificates> certificates)
      : certificates_(std::move(certificates)),
        credentials_(create(certificates_->knows_clients(), this), grpc_server_credentials_release) {}
#endif

  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {
    LPDEFORM_CHECK(!"calls are judged by Backend::identify");
  }

 private:
  static grpc_server_credentials* create(bool knows_clients, FreshCredentials* self) {
    return grpc_ssl_server_credentials_create_with_options(
        grpc_ssl_server_credentials_create_options_using_config_fetcher(
            knows_clients ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                          : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE,
            fetch, self));
  }

  /// gRPC calls this for one connection at a time.
  static grpc_ssl_certificate_config_reload_status fetch(void* self,
                                                         grpc_ssl_server_certificate_config** config) {
    auto& credentials = *static_cast<FreshCredentials*>(self);
    const Certificates::Current now = credentials.certificates_->current();
    if (now.number == credentials.given_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair{now.texts->key.c_str(), now.texts->chain.c_str()};
    // gRPC requires authorities. If no client is asked for a certificate, they are not used.
    const std::string& authorities =
        credentials.certificates_->knows_clients() ? now.texts->authorities : now.texts->chain;
    *config = grpc_ssl_server_certificate_config_create(authorities.c_str(), &pair, 1);
    credentials.given_ = now.number;
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const std::shared_ptr<Certificates> certificates_;
  std::uint64_t given_ = 0;

#ifndef LPDEFORM_GRPC_HOLDS_CREDENTIALS
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_.get());
  }
  const std::unique_ptr<grpc_server_credentials, decltype(&grpc_server_credentials_release)> credentials_;
#endif
};

}  // namespace

std::shared_ptr<grpc::ServerCredentials> make_credentials(const std::shared_ptr<Certificates>& certificates) {
  if (certificates == nullptr) return grpc::InsecureServerCredentials();
  return std::make_shared<FreshCredentials>(certificates);
}

}  // namespace lpdeform
