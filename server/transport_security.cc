#include "server/transport_security.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/ssl.h>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"

namespace lpdeform {
namespace {

constexpr unsigned kRefreshSeconds = 60;

absl::Status bad_file(const std::string& file, const std::string& why) {
  return invalid_input({"TLS_FILES", file, ""}, absl::StrCat("The TLS file \"", file, "\" ", why, "."));
}

/// gRPC would say nothing, and refuse every connection.
absl::Status check(const TlsFiles& files) {
  if (files.certificate_chain.empty() || files.private_key.empty()) {
    return invalid_input({"TLS_FILES", "", ""}, "TLS needs both a certificate chain and its private key.");
  }
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_server_method()),
                                                                  SSL_CTX_free);
  const char* const chain = files.certificate_chain.c_str();
  if (SSL_CTX_use_certificate_chain_file(context.get(), chain) != 1) {
    return bad_file(chain, "has no certificate that can be read");
  }
  const char* const key = files.private_key.c_str();
  if (SSL_CTX_use_PrivateKey_file(context.get(), key, SSL_FILETYPE_PEM) != 1) {
    return bad_file(key, "has no private key that can be read and fits the certificate");
  }
  if (!files.knows_clients()) return absl::OkStatus();
  const char* const authorities = files.client_authorities.c_str();
  if (SSL_CTX_load_verify_locations(context.get(), authorities, nullptr) != 1) {
    return bad_file(authorities, "has no certificate that can be read");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> make_credentials(const TlsFiles& files) {
  if (!files.is_on()) return grpc::InsecureServerCredentials();
  if (absl::Status status = check(files); !status.ok()) return status;
  const auto provider = std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
      files.private_key, files.certificate_chain, files.client_authorities, kRefreshSeconds);
  grpc::experimental::TlsServerCredentialsOptions options(provider);
  options.watch_identity_key_cert_pairs();
  options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  if (files.knows_clients()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

}  // namespace lpdeform
