// Metrics where nobody reads them: sessions without a service.

#include "server/runtime/metrics.h"

namespace lpdeform {

struct Metrics::Impl {};

Metrics::Metrics() = default;
Metrics::~Metrics() = default;

void Metrics::add(Count, double) {}
void Metrics::set(Level, double) {}
void Metrics::change(Level, double) {}
void Metrics::observe(Span, double) {}
void Metrics::call_started(const std::string&) {}
void Metrics::call_ended(const Call&) {}
void Metrics::rejected(const std::string&) {}
void Metrics::session_ended(const std::string&) {}
void Metrics::stream_ended(const std::string&) {}

std::string Metrics::text() const {
  return "";
}

}  // namespace lpdeform
