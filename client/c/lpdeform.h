/* The C interface of lpdeform, for game engines: meshes that deform on a server while their handles are moved.
 *
 *   lpdeform_client* client;
 *   lpdeform_connect(&(lpdeform_connection){.struct_size = sizeof(lpdeform_connection), .address = "localhost:50051"},
 *                    &client, &error);
 *   lpdeform_open(client, &mesh, NULL, &session, &error);        does not wait; loading goes on
 *   lpdeform_set_handle(session, &base, NULL, &error);           does not wait: sent when there is a connection
 *   each frame of the game:
 *     lpdeform_move_handle(session, "tip", &motion, NULL, &error);
 *     if (lpdeform_poll(session, &buffers, &frame, &error) == LPDEFORM_OK) upload the vertex buffer
 *   lpdeform_close(session); lpdeform_disconnect(client);
 *
 * Rules that hold throughout.
 *
 * Time. A function does not wait for the network, unless its comment begins with WAITS. Those that do not wait copy
 * their arguments, and take locks that nobody holds for longer than it takes to copy a frame or an update.
 *
 * Threads. Every function may be called from any thread at any time, and several at once, except that nothing may use a
 * session any more when lpdeform_close is called on it, nor a client when lpdeform_disconnect is. The library makes
 * threads of its own, three a session, and calls nothing back.
 *
 * Memory. What a caller passes in is copied before the function returns and stays the caller's; nothing that
 * the library returns is to be freed but clients, sessions and snapshots.
 *
 * Errors. Functions return a code (LPDEFORM_OK is 0) and fill in `error`, which may be NULL. A function that
 * returns an error has changed nothing. No exception leaves the library.
 *
 * Versions. A struct that is passed by itself begins with its size in bytes as the caller was compiled, so that it may
 * grow at its end: `lpdeform_mesh mesh = {.struct_size = sizeof mesh};`. Those that lie within others have none, and stay as they are
 * for as long as LPDEFORM_ABI does: lpdeform_source, _target, _motion, _point and _move. Fields are zero unless set, and
 * zero is the default everywhere; reserved ones must be (RESERVED_SET). A library that is older than its caller refuses
 * fields that it does not know, if they are set (STRUCT_TOO_NEW), rather than leave them out.
 *
 * Texts are UTF-8, ending in a zero byte. Vertex and face indices begin with 0; vertex order is never changed by
 * anybody, so what goes in from a vertex buffer comes out in its order.
 */
#ifndef LPDEFORM_H_
#define LPDEFORM_H_

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32) && defined(LPDEFORM_BUILDS_LIBRARY)
#define LPDEFORM_API __declspec(dllexport)
#elif defined(_WIN32)
#define LPDEFORM_API __declspec(dllimport)
#else
#define LPDEFORM_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Rises when a program compiled with an older header could not work with the library. */
#define LPDEFORM_ABI 1

/* The LPDEFORM_ABI of the library that runs. Cannot fail. */
LPDEFORM_API uint32_t lpdeform_abi(void);
/* Its release, "0.1.0". Cannot fail. */
LPDEFORM_API const char* lpdeform_version(void);

/* ---- errors ---- */

/* Those of gRPC, and one more. */
typedef int32_t lpdeform_code;
enum {
  LPDEFORM_OK = 0,
  LPDEFORM_CANCELLED = 1,
  LPDEFORM_UNKNOWN = 2,
  LPDEFORM_INVALID_ARGUMENT = 3, /* what was passed is wrong: `element` and `limit` say where */
  LPDEFORM_DEADLINE_EXCEEDED = 4,
  LPDEFORM_NOT_FOUND = 5,
  LPDEFORM_ALREADY_EXISTS = 6,
  LPDEFORM_PERMISSION_DENIED = 7,
  LPDEFORM_RESOURCE_EXHAUSTED = 8, /* the server is full, or memory is */
  LPDEFORM_FAILED_PRECONDITION = 9,
  LPDEFORM_ABORTED = 10, /* another writer took over */
  LPDEFORM_OUT_OF_RANGE = 11,
  LPDEFORM_UNIMPLEMENTED = 12,
  LPDEFORM_INTERNAL = 13,
  LPDEFORM_UNAVAILABLE = 14, /* no server, or it went away */
  LPDEFORM_DATA_LOSS = 15,
  LPDEFORM_UNAUTHENTICATED = 16,
  LPDEFORM_NO_FRAME = 100 /* no error: there is no newer frame, and nothing was written */
};

/* What is too long for its place ends in "...". */
typedef struct lpdeform_error {
  uint32_t struct_size;
  lpdeform_code code;
  char reason[48];   /* for programs: "MESH_INDEX_OUT_OF_RANGE"; see proto/errors.md. May be empty */
  char element[128]; /* the first offending one: "face 3". May be empty */
  char limit[128];   /* the bound that was broken: "0 <= vertex < 42". May be empty */
  char message[512]; /* one sentence for people */
} lpdeform_error;

/* ---- connecting ---- */

typedef struct lpdeform_client lpdeform_client;
typedef struct lpdeform_session lpdeform_session;

typedef struct lpdeform_connection {
  uint32_t struct_size;
  uint32_t tls;                   /* 1: TLS; 0: plain text, which the texts below must then be NULL for */
  const char* address;            /* "host:port", "unix:/path", "dns:///name:port" */
  const char* root_certificates;  /* PEM: whom to trust; NULL: whom the system trusts */
  const char* certificate_chain;  /* PEM: our own, where the server asks for one */
  const char* private_key;        /* PEM */
  const char* token;              /* bearer token of each call; see lpdeform_set_token. May be NULL */
  double connect_timeout_seconds; /* of one attempt; 0 takes 5 */
  double call_timeout_seconds;    /* of one call; 0 takes 30 */
  /* For how long a session tries to reach a server that is away, before it is over; 0 is for ever. */
  double reconnect_seconds;
} lpdeform_connection;

/* Makes a client of the server at that address; connecting goes on by itself. Errors: INVALID_ARGUMENT, also where a
 * certificate or key cannot be read, or they do not belong together (TLS_CERTIFICATES, TLS_PRIVATE_KEY, TLS_KEY_MISSING,
 * TLS_KEY_MISMATCH). */
LPDEFORM_API lpdeform_code lpdeform_connect(const lpdeform_connection* connection, lpdeform_client** client,
                                            lpdeform_error* error);

/* The bearer token of calls from now on; NULL or "": none. */
LPDEFORM_API lpdeform_code lpdeform_set_token(lpdeform_client* client, const char* token,
                                              lpdeform_error* error);

/* WAITS until every session of the client is closed, those too that lpdeform_close was not called for (they
 * then are over, and still to be given to lpdeform_close): usually milliseconds, at most about two seconds where the server
 * hangs, however many there are. What is being opened is given up. To be called before the process ends. NULL is fine. */
LPDEFORM_API void lpdeform_disconnect(lpdeform_client* client);

/* ---- vertex buffers ---- */

/* How a number or several lie in a buffer. */
typedef int32_t lpdeform_format;
enum {
  LPDEFORM_FLOAT32 = 0, /* positions and normals: 3, colours: 4 (r, g, b, 1), distortion: 1 */
  LPDEFORM_FLOAT64 = 1, /* the same in double precision; not of colours */
  /* Frames' positions: x, y, z and 65535 as 4 uint16, position = frame.origin + q / 65535 frame.extent. */
  LPDEFORM_UNORM16 = 2,
  LPDEFORM_SNORM16 = 3, /* frames' normals: x, y, z times 32767 and 0 as 4 int16 */
  LPDEFORM_SNORM8 = 4,  /* frames' normals: x, y, z times 127 and 0 as 4 int8 */
  LPDEFORM_RGBA8 = 5,   /* frames' colours: 4 uint8, a is 255 */
  LPDEFORM_BGRA8 = 6    /* the same in Unreal's order */
};

/* One attribute of vertices to be read: at data + offset + i stride for vertex i. */
typedef struct lpdeform_source {
  const void* data; /* NULL: there is none */
  size_t bytes;     /* of the whole buffer: never read beyond */
  uint32_t offset;  /* of the first vertex's, in bytes */
  uint32_t stride;  /* from vertex to vertex, in bytes; 0: without gaps */
  lpdeform_format format;
  uint32_t reserved; /* 0 */
} lpdeform_source;

/* One attribute of vertices to be written, at data + offset + i stride; bytes between are left alone. No
 * alignment is needed. */
typedef struct lpdeform_target {
  void* data;      /* NULL: not wanted */
  size_t bytes;    /* of the whole buffer: never written beyond */
  uint32_t offset; /* of the first vertex's, in bytes */
  uint32_t stride; /* from vertex to vertex, in bytes; 0: without gaps */
  lpdeform_format format;
  uint32_t reserved; /* 0 */
} lpdeform_target;

/* ---- opening ---- */

typedef int32_t lpdeform_index_format;
enum { LPDEFORM_UINT32 = 0, LPDEFORM_UINT16 = 1 };

/* A triangle mesh as an engine has it. */
typedef struct lpdeform_mesh {
  uint32_t struct_size;
  uint32_t vertex_count;
  lpdeform_source positions; /* FLOAT32 or FLOAT64 */
  /* FLOAT32 or FLOAT64, as drawn at rest: frames with normals then carry them along (hard edges stay hard, seams
   * do not show). Without: smooth ones. */
  lpdeform_source normals;
  const void* indices;  /* three a triangle */
  uint32_t index_count; /* a multiple of 3 */
  lpdeform_index_format index_format;
  /* Engines have several vertices where texture coordinates or normals change along a seam. 1: those in the same
   * place are one, deform as one, and get the same positions to the last bit. See weld_tolerance. */
  uint32_t weld_by_position;
  uint32_t reserved; /* 0 */
  /* In place of that, one number a vertex: those with the same number are one. May be NULL. */
  const uint32_t* weld_groups;
  /* With weld_by_position: how far apart vertices of one place may be, as a share of the bounding box's diagonal, 0 to
   * 0.001; 0 is the server's, 1e-6. */
  double weld_tolerance;
} lpdeform_mesh;

/* The engine's coordinates. The server's are right-handed, with y up, in metres, and triangles are
 * counter-clockwise seen from outside, as in glTF. */
typedef int32_t lpdeform_handedness;
enum {
  LPDEFORM_RIGHT_HANDED = 0,
  LPDEFORM_LEFT_HANDED = 1 /* Unity, Unreal. With y up x changes its sign, with z up y and z are swapped */
};
typedef int32_t lpdeform_up;
enum {
  LPDEFORM_Y_UP = 0, /* Unity, Godot */
  LPDEFORM_Z_UP = 1  /* Unreal, Blender */
};
/* Of triangles seen from outside, by a person: mirrored coordinates do not change it. Unreal, which takes
 * (C - A) x (B - A) in left-handed coordinates for the normal of A, B, C, is counter-clockwise. */
typedef int32_t lpdeform_winding;
enum {
  LPDEFORM_WINDING_USUAL = 0, /* clockwise where left-handed with y up (Unity), otherwise not (Unreal) */
  LPDEFORM_COUNTER_CLOCKWISE = 1,
  LPDEFORM_CLOCKWISE = 2 /* Godot, too */
};

/* How frames travel; the C interface gives the same formats for all of them. */
typedef int32_t lpdeform_encoding;
enum {
  LPDEFORM_ENCODING_RAW = 0,       /* 12 bytes a vertex, 28 with distortion and normals */
  LPDEFORM_ENCODING_QUANTIZED = 1, /* 8 bytes, with distortion; exact to 1/131070 of the extent */
  LPDEFORM_ENCODING_COMPRESSED = 2 /* the same numbers in about 3 bytes */
};

/* Of a cell's edges in the energy; see WeightKind of client/cpp/types.h. */
typedef int32_t lpdeform_weights;
enum { LPDEFORM_COTANGENT = 0, LPDEFORM_UNIFORM = 1, LPDEFORM_INTRINSIC_DELAUNAY = 2 };

/* What becomes of a connected component that no handle holds. */
typedef int32_t lpdeform_free_components;
enum {
  LPDEFORM_FREE_COMPONENTS_ERROR = 0, /* poll says COMPONENT_WITHOUT_HANDLE, and the surface stays as it is */
  LPDEFORM_FREE_COMPONENTS_STAY = 1,
  LPDEFORM_FREE_COMPONENTS_FOLLOW = 2 /* moves rigidly with the nearest handle */
};

typedef struct lpdeform_options {
  uint32_t struct_size;
  lpdeform_handedness handedness;
  lpdeform_up up;
  lpdeform_winding winding;
  double units_per_metre; /* 100 where the engine's unit is the centimetre (Unreal); 0 takes 1 */
  lpdeform_weights weights;
  lpdeform_free_components free_components;
  lpdeform_encoding encoding;
  lpdeform_encoding lowest_encoding; /* what a server with a limit of bytes a second may go down to */
  uint32_t with_normals;             /* 1: frames have normals */
  uint32_t without_distortion;       /* 1: frames need no distortion, and have none where they are raw */
  uint32_t double_precision;         /* 1: raw frames travel as float64 */
  uint32_t certify;                  /* 1: a result that stands comes again with its optimality_gap */
  uint32_t credit;                   /* frames under way and not taken yet, 1 to 8; 0 takes 2 */
  uint32_t reserved;                 /* 0 */
  double max_frames_per_second;      /* 0 is without limit; the last frame of an update always comes */
} lpdeform_options;

/* Begins to make a session of the mesh on the server; `options` may be NULL. Handles may be set at once: they
 * are sent as soon as there is a session. Copies the mesh, which takes about a millisecond for 10,000
 * vertices. The session is the caller's to lpdeform_close. Errors: INVALID_ARGUMENT where a buffer is too small or an
 * enum unknown. What the server says of the mesh comes later, as LPDEFORM_STATE_REFUSED. */
LPDEFORM_API lpdeform_code lpdeform_open(lpdeform_client* client, const lpdeform_mesh* mesh,
                                         const lpdeform_options* options, lpdeform_session** session,
                                         lpdeform_error* error);

typedef int32_t lpdeform_role;
enum { LPDEFORM_READER = 0, LPDEFORM_WRITER = 1 /* in place of whoever is */ };

/* The same with a session that somebody else made and goes on when this one is closed; `name` as
 * lpdeform_session_name tells. Of `options`, the mesh's (weights, free_components) are not used. */
LPDEFORM_API lpdeform_code lpdeform_join(lpdeform_client* client, const char* name, lpdeform_role role,
                                         const lpdeform_options* options, lpdeform_session** session,
                                         lpdeform_error* error);

/* A session as a file: mesh, handles, settings, what can be undone and the surface as it is. */
typedef struct lpdeform_snapshot lpdeform_snapshot;

/* WAITS for the session as a file, with every change before it; frames go on, and changes made meanwhile are sent after it.
 * The snapshot is the caller's to lpdeform_free_snapshot. Errors: FAILED_PRECONDITION NOT_CONNECTED while there is no session
 * on the server yet; DEADLINE_EXCEEDED after call_timeout_seconds; what the server says of it or of a change before it. */
LPDEFORM_API lpdeform_code lpdeform_take_snapshot(lpdeform_session* session, lpdeform_snapshot** snapshot,
                                                  lpdeform_error* error);
/* What is to be written to a file, until the snapshot is freed. NULL, and 0 bytes, of NULL. Cannot fail. */
LPDEFORM_API const void* lpdeform_snapshot_data(const lpdeform_snapshot* snapshot, size_t* bytes);
/* NULL is fine. */
LPDEFORM_API void lpdeform_free_snapshot(lpdeform_snapshot* snapshot);

/* As lpdeform_open, of such a file, on any server of the same version or a later one; the surface is the same to the last bit,
 * in the coordinates that `options` says. What the file says of the mesh (weights, free_components) is not asked of `options`.
 * A file that is none, is damaged or of a newer version comes as LPDEFORM_STATE_REFUSED (SNAPSHOT_FOREIGN and so on). */
LPDEFORM_API lpdeform_code lpdeform_restore(lpdeform_client* client, const void* data, size_t bytes,
                                            const lpdeform_options* options, lpdeform_session** session,
                                            lpdeform_error* error);

/* The session is no more for the caller; its end on the server goes on by itself. NULL is fine. */
LPDEFORM_API void lpdeform_close(lpdeform_session* session);

typedef int32_t lpdeform_state;
enum {
  LPDEFORM_STATE_CONNECTING = 0, /* not yet there; `why` says what the last attempt met with */
  LPDEFORM_STATE_LIVE = 1,
  LPDEFORM_STATE_RECONNECTING = 2, /* the server is away: the last frame stands, work goes on after */
  LPDEFORM_STATE_REFUSED = 3       /* over for good; `why` says why */
};

/* How the session is. `why` may be NULL; its code is LPDEFORM_OK where there is nothing to say. NULL is REFUSED. */
LPDEFORM_API lpdeform_state lpdeform_session_state(const lpdeform_session* session, lpdeform_error* why);

/* What a server says about itself, or about the mesh; nothing failed. */
typedef int32_t lpdeform_notice;
enum {
  LPDEFORM_NOTICE_NONE = 0,
  LPDEFORM_NOTICE_OVERLOADED = 1, /* it has more to solve than it can: frames come less often */
  LPDEFORM_NOTICE_RECOVERED = 2,  /* no more */
  LPDEFORM_NOTICE_OTHER = 3,      /* what only a newer server says */
  LPDEFORM_NOTICE_MESH = 4 /* of the mesh: where it is split and comes apart. Until something else is said */
};

/* What the server said last on the connection that there is, or of the mesh; NONE where it said nothing, and of NULL.
 * `text`, of `bytes` bytes, becomes one sentence for people, cut as those of errors; it may be NULL. For a line in a log when it changes. */
LPDEFORM_API lpdeform_notice lpdeform_session_notice(const lpdeform_session* session, char* text,
                                                     size_t bytes);

/* "sessions/<32 hexadecimal digits>", for lpdeform_join; another one after the server lost it. FAILED_PRECONDITION while
 * there is none. INVALID_ARGUMENT where `bytes` are too few: 64 are enough. */
LPDEFORM_API lpdeform_code lpdeform_session_name(const lpdeform_session* session, char* name, size_t bytes,
                                                 lpdeform_error* error);

/* Of its mesh; 0 while a session that was joined or restored is not there yet. */
LPDEFORM_API uint32_t lpdeform_vertex_count(const lpdeform_session* session);

/* ---- handles ---- */

typedef int32_t lpdeform_motion_kind;
enum {
  LPDEFORM_FIXED = 0,    /* stays where the rest mesh has it */
  LPDEFORM_RIGID = 1,    /* x = R (p - center) + center + translation, p at rest: never added up */
  LPDEFORM_POSITIONS = 2 /* absolute ones, one for each vertex or point */
};

typedef struct lpdeform_motion {
  lpdeform_motion_kind kind;
  uint32_t position_count; /* as many as the handle has vertices or points */
  double rotation[4];      /* quaternion x, y, z, w as the engine has it, of any length; all 0: none */
  double center[3];
  double translation[3];
  const double* positions; /* 3 position_count */
} lpdeform_motion;

/* How a handle is held. */
typedef int32_t lpdeform_hold;
enum lpdeform_hold_values {
  LPDEFORM_EXACTLY = 0,
  LPDEFORM_SOFT = 1,        /* drawn to its target by `weight` */
  LPDEFORM_ORIENTATION = 2, /* turned by the motion's rotation, its position free; `weight` */
  LPDEFORM_AXIS_LOCK = 3,   /* free along the line through its target in `direction` */
  LPDEFORM_PLANE_LOCK = 4   /* free in the plane through its target across `direction` */
};

/* A point inside a face: barycentric coordinates times the face's corners in their order. */
typedef struct lpdeform_point {
  uint32_t face;
  uint32_t reserved; /* 0 */
  double barycentric[3];
} lpdeform_point;

typedef struct lpdeform_handle {
  uint32_t struct_size;
  lpdeform_hold hold;
  const char* name;
  const uint32_t* vertices;     /* either these, each held by one handle at most; */
  const lpdeform_point* points; /* or these, exactly or soft */
  uint32_t vertex_count;
  uint32_t point_count;
  lpdeform_motion motion;
  double weight;       /* up to 1e6; 0 takes 1 (SOFT) or 100 (ORIENTATION) */
  double direction[3]; /* of any length but 0 */
  double footprint;    /* radius of the surroundings that go along nearly rigidly; 0: none */
} lpdeform_handle;

typedef int32_t lpdeform_method;
enum {
  LPDEFORM_METHOD_AUTO = 0,
  LPDEFORM_METHOD_QUASI_NEWTON = 1,
  LPDEFORM_METHOD_LINE_SEARCH = 2,
  LPDEFORM_METHOD_LOCAL_GLOBAL = 3,
  LPDEFORM_METHOD_CONIC = 4,
  LPDEFORM_METHOD_MULTIRESOLUTION = 5
};

/* What is 0 or NULL keeps its value. */
typedef struct lpdeform_settings {
  uint32_t struct_size;
  uint32_t p_count;           /* of p_per_vertex: one a vertex */
  double p;                   /* 1 to 64, everywhere; */
  const double* p_per_vertex; /* or one a vertex; */
  double p_automatic;         /* or from the geometry, with this strength, up to 1 */
  double stiffness;           /* 1e-6 to 1e6, everywhere; */
  const double* stiffness_per_vertex;
  double stiffness_automatic;
  uint32_t stiffness_count;
  uint32_t reserved;  /* 0 */
  double length_unit; /* of mixed norms; negative takes the mean edge length back */
  /* 1: the next four replace the server's, whole. */
  uint32_t set_solver;
  lpdeform_method method;
  double tolerance;
  double time_limit_seconds;
  uint32_t max_iterations;
  /* 1: only the vertices of the region may move from now on; with none, everything may. */
  uint32_t set_region;
  const uint32_t* region;
  uint32_t region_count;
  uint32_t reserved_too; /* 0 */
} lpdeform_settings;

/* A motion for a handle that is there. */
typedef struct lpdeform_move {
  const char* name;
  lpdeform_motion motion;
} lpdeform_move;

/* A change of handles and settings, which the server takes whole or not at all. */
typedef struct lpdeform_update {
  uint32_t struct_size;
  uint32_t set_count;
  const lpdeform_handle* sets; /* added, or replaced */
  const lpdeform_move* moves;
  const char* const* removals;
  uint32_t move_count;
  uint32_t removal_count;
  const lpdeform_settings* settings; /* may be NULL */
  /* 1: what it does to handles is a step of its own for lpdeform_undo; to be set when a drag begins. */
  uint32_t begins_step;
  uint32_t reserved; /* 0 */
} lpdeform_update;

/* Sends a change. Changes made faster than the connection takes them are merged, the newest of each handle and
 * each setting winning. `input_seq`, where not NULL, becomes the change's number: a frame whose input_seq is at
 * least that takes it into account. Errors: INVALID_ARGUMENT where the change makes no sense by itself, NAME_ENCODING where
 * a name is not UTF-8; what the server says of it comes out of lpdeform_poll, once. For a reader FAILED_PRECONDITION
 * NOT_THE_WRITER. Once the session is over, why: what lpdeform_session_state says. */
LPDEFORM_API lpdeform_code lpdeform_send(lpdeform_session* session, const lpdeform_update* update,
                                         uint64_t* input_seq, lpdeform_error* error);

/* Adds the handle, or replaces the one of its name. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_set_handle(lpdeform_session* session, const lpdeform_handle* handle,
                                               uint64_t* input_seq, lpdeform_error* error);
/* Moves a handle. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_move_handle(lpdeform_session* session, const char* name,
                                                const lpdeform_motion* motion, uint64_t* input_seq,
                                                lpdeform_error* error);
/* Lets go of a handle. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_remove_handle(lpdeform_session* session, const char* name,
                                                  uint64_t* input_seq, lpdeform_error* error);
/* Changes p, stiffness and so on. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_set(lpdeform_session* session, const lpdeform_settings* settings,
                                        uint64_t* input_seq, lpdeform_error* error);

/* A scaling by different factors along three axes, in which what is salient keeps its shape and size. */
typedef struct lpdeform_resizing {
  uint32_t struct_size;
  uint32_t set_origin; /* 1: `origin` stays where it is; 0: the middle of the mesh's bounding box does */
  uint32_t set_axes;   /* 1: the axes below; 0: the engine's x, y and z */
  uint32_t reserved;   /* 0 */
  double scale[3];     /* along the axes, relative to the mesh at rest: 0.01 to 100; 0 takes 1 */
  double origin[3];
  double x_axis[3]; /* of any length but 0 */
  double y_axis[3]; /* what of it is across x_axis counts; the third axis is across both */
} lpdeform_resizing;

/* Scales the mesh: sets the handle "resize", which holds the ends of each component along the scaled axes, and p and
 * stiffness. Along other axes the extent changes, unless plane locks hold ends there. To end it, remove that handle and
 * set p and stiffness. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_resize(lpdeform_session* session, const lpdeform_resizing* resizing,
                                           uint64_t* input_seq, lpdeform_error* error);

/* WAITS until the server has taken the newest step of the handles back, as lpdeform_send sends a change: frames follow. A
 * step is what a person sees as one change: changes that move the same handles, none of them over a second after the one
 * before, or each other change of handles; lpdeform_update.begins_step begins one in any case. Settings are no part of it.
 * Errors: FAILED_PRECONDITION (NOTHING_TO_UNDO, also of what came before the server lost the session; NOT_CONNECTED while
 * there is none on the server yet; NOT_THE_WRITER), DEADLINE_EXCEEDED after call_timeout_seconds, what the server says of a
 * change before it. */
LPDEFORM_API lpdeform_code lpdeform_undo(lpdeform_session* session, uint64_t* input_seq,
                                         lpdeform_error* error);
/* Does again what was taken back last. As lpdeform_undo; NOTHING_TO_REDO. */
LPDEFORM_API lpdeform_code lpdeform_redo(lpdeform_session* session, uint64_t* input_seq,
                                         lpdeform_error* error);

/* ---- frames ---- */

/* Where a frame is to be written, in the engine's coordinates. */
typedef struct lpdeform_buffers {
  uint32_t struct_size;
  uint32_t reserved;          /* 0 */
  lpdeform_target positions;  /* FLOAT32, FLOAT64 or UNORM16 */
  lpdeform_target normals;    /* FLOAT32, FLOAT64, SNORM16 or SNORM8; needs with_normals */
  lpdeform_target colours;    /* FLOAT32, RGBA8 or BGRA8: distortion from blue (none) to red */
  lpdeform_target distortion; /* FLOAT32 or FLOAT64: E_i of each vertex, lengths in metres */
  /* The distortion that is shown as full red. 0: the frame's 95th percentile. */
  double red_distortion;
} lpdeform_buffers;

typedef int32_t lpdeform_stop_reason;
enum {
  LPDEFORM_RUNNING = 0,
  LPDEFORM_CONVERGED = 1,
  LPDEFORM_ITERATION_LIMIT = 2,
  LPDEFORM_TIME_LIMIT = 3,
  LPDEFORM_SOLVE_CANCELLED = 4,
  LPDEFORM_STALLED = 5,
  LPDEFORM_NUMERICAL_BREAKDOWN = 6
};

/* What is to be known of a frame. */
typedef struct lpdeform_frame {
  uint32_t struct_size;
  uint32_t vertex_count;
  uint64_t input_seq; /* the newest change that it answers */
  uint64_t frame_seq;
  uint64_t epoch;
  uint64_t skipped_inputs; /* changes since the frame before that no frame answers */
  uint32_t iteration;
  uint32_t is_final; /* 1: the result, however it ended; no further frame until there is a new change */
  lpdeform_stop_reason stop_reason;
  uint32_t has_optimality_gap;
  double energy; /* lengths in metres */
  double soft_energy;
  double solve_seconds;
  double optimality_gap; /* where has_optimality_gap; see OpenOptions::certify of client/cpp/client.h */
  double red_distortion; /* that the colours were made with; 0 without colours */
  double origin[3];      /* of UNORM16 positions, in the engine's coordinates; 0 without */
  double extent[3];
} lpdeform_frame;

/* Takes the newest frame that was not taken yet, and writes it. LPDEFORM_NO_FRAME where there is none:
 * then, as with errors, nothing was written, and what the buffers had from the frame before still stands.
 * `frame` may be NULL. Errors: what the server had to say about a change (once; the session goes on); once the session is over,
 * why; INVALID_ARGUMENT where a buffer is too small or a format not one of its attribute's, FAILED_PRECONDITION
 * where normals or distortion are wanted that the session was opened without: then the frame waits on. */
LPDEFORM_API lpdeform_code lpdeform_poll(lpdeform_session* session, const lpdeform_buffers* buffers,
                                         lpdeform_frame* frame, lpdeform_error* error);

/* Writes the frame taken last, by whichever thread, once more, for engines whose buffers do not keep what was written; also
 * while the server is away and after the session is over. LPDEFORM_NO_FRAME where none was taken. */
LPDEFORM_API lpdeform_code lpdeform_repeat(lpdeform_session* session, const lpdeform_buffers* buffers,
                                           lpdeform_frame* frame, lpdeform_error* error);

/* WAITS until the finished result of the newest change has come, and writes it; for tools and loading screens. At once
 * where it was taken before. Takes frames meanwhile. DEADLINE_EXCEEDED where none came; other errors as lpdeform_poll. */
LPDEFORM_API lpdeform_code lpdeform_settle(lpdeform_session* session, double timeout_seconds,
                                           const lpdeform_buffers* buffers, lpdeform_frame* frame,
                                           lpdeform_error* error);

typedef struct lpdeform_solve_options {
  uint32_t struct_size;
  uint32_t certify;       /* 1: find frame.optimality_gap */
  double timeout_seconds; /* of the whole call, waiting for another included; 0 is without limit */
} lpdeform_solve_options;

/* WAITS for a solve of its own to the end, for the present handles and settings, and writes the result in full precision;
 * for tools. Takes no frames: frame_seq and epoch are 0. Normals need no with_normals. `options` may be NULL. One at a
 * time; while one runs no change is sent: those made meanwhile are sent after it, and frames do not follow them until then.
 * Errors: what the server refuses; DEADLINE_EXCEEDED; UNAVAILABLE where it stayed away for reconnect_seconds; by
 * lpdeform_disconnect CANCELLED, or FAILED_PRECONDITION SESSION_CLOSED where it had not begun. A solve that stopped short
 * is no error: frame.stop_reason says so. */
LPDEFORM_API lpdeform_code lpdeform_solve(lpdeform_session* session, const lpdeform_solve_options* options,
                                          const lpdeform_buffers* buffers, lpdeform_frame* frame,
                                          lpdeform_error* error);

#ifdef __cplusplus
}
#endif

#endif /* LPDEFORM_H_ */
