/* What libcurl calls of macOS' SystemConfiguration, as CFTimeZone.h. */
#pragma once

#include <CoreFoundation/CFTimeZone.h>

extern CFDictionaryRef SCDynamicStoreCopyProxies(const void* store);
