#include "client/cpp/grpc_web/web_schannel.h"

#define SECURITY_WIN32
#include <winsock2.h>  // before windows.h

#include <windows.h>

#include <schannel.h>
#include <security.h>
#include <wincrypt.h>

#include <memory>

#include "absl/strings/str_cat.h"

namespace lpdeform::client {
namespace {

struct CertificateEnd {
  void operator()(const CERT_CONTEXT* certificate) const { CertFreeCertificateContext(certificate); }
};
struct ChainEnd {
  void operator()(const CERT_CHAIN_CONTEXT* chain) const { CertFreeCertificateChain(chain); }
};

std::string text_of(DWORD error) {
  switch (static_cast<HRESULT>(error)) {
    case static_cast<HRESULT>(CERT_E_UNTRUSTEDROOT):
    case static_cast<HRESULT>(CERT_E_CHAINING):
      return "no root certificate that this system trusts has signed it";
    case static_cast<HRESULT>(CERT_E_CN_NO_MATCH):
      return "it is for another host";
    case static_cast<HRESULT>(CERT_E_EXPIRED):
      return "it has expired or is not valid yet";
    default:
      return absl::StrCat("error 0x", absl::Hex(error, absl::kZeroPad8), " of Windows");
  }
}

}  // namespace

std::string why_not_trusted(void* context, const std::string& host) {
  constexpr char kNoChain[] = "The server's certificate cannot be read.";
  PCCERT_CONTEXT shown = nullptr;
  if (QueryContextAttributesW(static_cast<PCtxtHandle>(context), SECPKG_ATTR_REMOTE_CERT_CONTEXT, &shown) !=
      SEC_E_OK)
    return kNoChain;
  const std::unique_ptr<const CERT_CONTEXT, CertificateEnd> certificate(shown);
  char usage[] = szOID_PKIX_KP_SERVER_AUTH;
  char* usages[] = {usage};
  CERT_CHAIN_PARA wanted{};
  wanted.cbSize = sizeof wanted;
  wanted.RequestedUsage.Usage.cUsageIdentifier = 1;
  wanted.RequestedUsage.Usage.rgpszUsageIdentifier = usages;
  PCCERT_CHAIN_CONTEXT built = nullptr;
  if (!CertGetCertificateChain(nullptr, shown, nullptr, shown->hCertStore, &wanted, 0, nullptr, &built))
    return kNoChain;
  const std::unique_ptr<const CERT_CHAIN_CONTEXT, ChainEnd> chain(built);

  std::wstring name(host.begin(), host.end());
  SSL_EXTRA_CERT_CHAIN_POLICY_PARA server{};
  server.cbSize = sizeof server;
  server.dwAuthType = AUTHTYPE_SERVER;
  server.pwszServerName = name.data();
  CERT_CHAIN_POLICY_PARA policy{};
  policy.cbSize = sizeof policy;
  policy.pvExtraPolicyPara = &server;
  CERT_CHAIN_POLICY_STATUS status{};
  status.cbSize = sizeof status;
  if (!CertVerifyCertificateChainPolicy(CERT_CHAIN_POLICY_SSL, built, &policy, &status)) return kNoChain;
  if (status.dwError == 0) return "";
  return absl::StrCat("The server's certificate is not trusted: ", text_of(status.dwError), ".");
}

}  // namespace lpdeform::client
