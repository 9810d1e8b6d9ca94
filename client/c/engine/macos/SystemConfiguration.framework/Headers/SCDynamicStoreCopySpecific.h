/* What libcurl calls of macOS' frameworks, for compilers that do not bring them (client/c/engine/CMakeLists.txt). */
#pragma once

typedef const struct __CFDictionary* CFDictionaryRef;
extern CFDictionaryRef SCDynamicStoreCopyProxies(const void* store);
extern void CFRelease(const void* object);
