#pragma once

#include <string>
#include <string_view>

namespace lpdeform {

/// The trace id of a W3C Trace Context header, "00-<32 hexadecimal digits>-<16>-<2>"; empty if the header has
/// another form (https://www.w3.org/TR/trace-context/, 3.2). Headers of later versions may continue after the
/// flags.
std::string trace_id_of(std::string_view traceparent);

}  // namespace lpdeform
