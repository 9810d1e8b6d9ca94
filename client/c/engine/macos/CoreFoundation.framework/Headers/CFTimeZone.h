/* What libcurl and Abseil call of macOS' CoreFoundation, for compilers that do not bring it (client/c/engine/CMakeLists.txt). */
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

typedef const void* CFTypeRef;
typedef const struct __CFDictionary* CFDictionaryRef;
typedef const struct __CFString* CFStringRef;
typedef const struct __CFTimeZone* CFTimeZoneRef;
typedef long CFIndex;
typedef unsigned int CFStringEncoding;
enum { kCFStringEncodingUTF8 = 0x08000100 };

extern void CFRelease(CFTypeRef object);
extern CFTimeZoneRef CFTimeZoneCopyDefault(void);
extern CFStringRef CFTimeZoneGetName(CFTimeZoneRef zone);
extern CFIndex CFStringGetLength(CFStringRef text);
extern CFIndex CFStringGetMaximumSizeForEncoding(CFIndex length, CFStringEncoding encoding);
extern unsigned char CFStringGetCString(CFStringRef text, char* buffer, CFIndex size,
                                        CFStringEncoding encoding);

#ifdef __cplusplus
}
#endif
