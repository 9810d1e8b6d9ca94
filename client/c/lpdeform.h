/* The C interface of lpdeform, for game engines: meshes that deform on a server while their handles are moved.
 *
 *   lpdeform_client* client;
 *   lpdeform_connect(&(lpdeform_connection){.struct_size = sizeof(lpdeform_connection), .address = "localhost:50051"},
 *                    &client, &error);
 *   lpdeform_open(client, &mesh, NULL, &session, &error);        does not wait; the upload runs in the background
 *   lpdeform_set_handle(session, &base, NULL, &error);           does not wait: sent when there is a connection
 *   each frame of the game:
 *     lpdeform_move_handle(session, "tip", &motion, NULL, &error);
 *     if (lpdeform_poll(session, &buffers, &frame, &error) == LPDEFORM_OK) upload the vertex buffer
 *   lpdeform_close(session); lpdeform_disconnect(client);
 *
 * The address is that of the server if the library has gRPC in it, as a build of the project makes it. A library of
 * deploy/engine-library and of the packages for engines and .NET has gRPC-Web in it, and is given the address of the
 * Envoy in front of the server: "localhost:8080" with deploy/up.
 *
 * Rules that hold throughout.
 *
 * Time. A function whose comment begins with WAITS waits for the network. All other functions only copy their
 * arguments, and take locks that no thread holds longer than it takes to copy a frame or an update.
 *
 * Threads. All functions are thread-safe, with one exception: when lpdeform_close is called on a session, or
 * lpdeform_disconnect on a client, no other thread may use it any more. The library starts threads of its own, three
 * per session, and makes no callbacks.
 *
 * Memory. Arguments are copied before a function returns, and stay the caller's. Of what the library returns, the
 * caller must free only clients, sessions and snapshots.
 *
 * Errors. Functions return a code (LPDEFORM_OK is 0) and fill in `error`, which may be NULL. A function that
 * returns an error has changed nothing. No exception leaves the library.
 *
 * Versions. A struct that is passed by itself begins with its size in bytes at the time when the caller was compiled,
 * so that later versions can add fields at its end: `lpdeform_mesh mesh = {.struct_size = sizeof mesh};`. Structs
 * inside other structs have no size, and do not change as long as LPDEFORM_ABI does not: lpdeform_source, _target,
 * _motion, _point and _move. Initialise all fields to zero, which is the default everywhere. Reserved fields must be
 * zero (RESERVED_SET). If a caller sets a field that an older library does not know, the library returns an error
 * (STRUCT_TOO_NEW) instead of ignoring the field.
 *
 * Texts are UTF-8 and end with a zero byte. Vertex and face indices begin with 0. The vertex order never changes:
 * results have the order of the vertex buffer that was passed in.
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

/* Increases when programs compiled with an older header no longer work with the library. */
#define LPDEFORM_ABI 1

/* The LPDEFORM_ABI of the loaded library. Cannot fail. */
LPDEFORM_API uint32_t lpdeform_abi(void);
/* The version of the loaded library, "0.1.0". Cannot fail. */
LPDEFORM_API const char* lpdeform_version(void);

/* ---- errors ---- */

/* The status codes of gRPC, and one more. */
typedef int32_t lpdeform_code;
enum {
  LPDEFORM_OK = 0,
  LPDEFORM_CANCELLED = 1,
  LPDEFORM_UNKNOWN = 2,
  LPDEFORM_INVALID_ARGUMENT = 3, /* an argument is wrong: see `element` and `limit` */
  LPDEFORM_DEADLINE_EXCEEDED = 4,
  LPDEFORM_NOT_FOUND = 5,
  LPDEFORM_ALREADY_EXISTS = 6,
  LPDEFORM_PERMISSION_DENIED = 7,
  LPDEFORM_RESOURCE_EXHAUSTED = 8, /* the server is full, or out of memory */
  LPDEFORM_FAILED_PRECONDITION = 9,
  LPDEFORM_ABORTED = 10, /* another writer took over */
  LPDEFORM_OUT_OF_RANGE = 11,
  LPDEFORM_UNIMPLEMENTED = 12,
  LPDEFORM_INTERNAL = 13,
  LPDEFORM_UNAVAILABLE = 14, /* no server, or the connection broke */
  LPDEFORM_DATA_LOSS = 15,
  LPDEFORM_UNAUTHENTICATED = 16,
  LPDEFORM_NO_FRAME = 100 /* not an error: there is no newer frame; nothing was written */
};

/* Texts that are too long are cut and end in "...". */
typedef struct lpdeform_error {
  uint32_t struct_size;
  lpdeform_code code;
  char reason[48];   /* for programs: one of lpdeform_reasons.h. May be empty */
  char element[128]; /* the first offending element: "face 3". May be empty */
  char limit[128];   /* the bound that was broken: "0 <= vertex < 42". May be empty */
  char message[512]; /* one sentence for people */
} lpdeform_error;

/* ---- connecting ---- */

typedef struct lpdeform_client lpdeform_client;
typedef struct lpdeform_session lpdeform_session;

typedef struct lpdeform_connection {
  uint32_t struct_size;
  uint32_t tls; /* 1: TLS; 0: plain text; the PEM texts below must then be NULL */
  /* Of the server: "host:port", "unix:/path", or another name that gRPC knows, such as "dns:///name:port". A library
   * with gRPC-Web takes the address of Envoy instead: "host:port", "http://host:port", "https://host:port" or
   * "unix:/path". Others are refused (ADDRESS_INVALID). */
  const char* address;
  const char* root_certificates;  /* PEM: trusted roots; NULL: those that the system trusts */
  const char* certificate_chain;  /* PEM: of this client, if the server requires one (mutual TLS) */
  const char* private_key;        /* PEM */
  const char* token;              /* bearer token of each call; see lpdeform_set_token. May be NULL */
  double connect_timeout_seconds; /* of one attempt; 0 means 5 */
  double call_timeout_seconds;    /* of one call; 0 means 30 */
  /* How long a session retries while its server is unreachable before it ends; 0 means without limit. */
  double reconnect_seconds;
} lpdeform_connection;

/* Creates a client of the server at that address; connects in the background. Errors: INVALID_ARGUMENT, also if a
 * certificate or key cannot be read, or if they do not belong together (TLS_CERTIFICATES, TLS_PRIVATE_KEY,
 * TLS_KEY_MISSING, TLS_KEY_MISMATCH). */
LPDEFORM_API lpdeform_code lpdeform_connect(const lpdeform_connection* connection, lpdeform_client** client,
                                            lpdeform_error* error);

/* Sets the bearer token of all calls from now on; NULL or "": none. */
LPDEFORM_API lpdeform_code lpdeform_set_token(lpdeform_client* client, const char* token,
                                              lpdeform_error* error);

/* WAITS until every session of the client is closed: usually milliseconds, at most about two seconds if the server
 * hangs, however many sessions there are. Sessions for which lpdeform_close was not called end as well, but must
 * still be passed to lpdeform_close. Sessions that are being opened are aborted. Call this before the process ends.
 * `client` may be NULL. */
LPDEFORM_API void lpdeform_disconnect(lpdeform_client* client);

/* ---- vertex buffers ---- */

/* How the value of an attribute is stored in a buffer. */
typedef int32_t lpdeform_format;
enum {
  LPDEFORM_FLOAT32 = 0, /* positions and normals: 3, colours: 4 (r, g, b, 1), distortion: 1 */
  LPDEFORM_FLOAT64 = 1, /* the same in double precision; not for colours */
  /* Frames' positions: x, y, z and 65535 as 4 uint16, position = frame.origin + q / 65535 frame.extent. */
  LPDEFORM_UNORM16 = 2,
  LPDEFORM_SNORM16 = 3, /* frames' normals: x, y, z times 32767 and 0 as 4 int16 */
  LPDEFORM_SNORM8 = 4,  /* frames' normals: x, y, z times 127 and 0 as 4 int8 */
  LPDEFORM_RGBA8 = 5,   /* frames' colours: 4 uint8, a is 255 */
  LPDEFORM_BGRA8 = 6    /* the same in Unreal's channel order */
};

/* A vertex attribute to read: at data + offset + i stride for vertex i. */
typedef struct lpdeform_source {
  const void* data; /* NULL: there is none */
  size_t bytes;     /* size of the whole buffer; nothing beyond is read */
  uint32_t offset;  /* of the first vertex, in bytes */
  uint32_t stride;  /* from vertex to vertex, in bytes; 0: without gaps */
  lpdeform_format format;
  uint32_t reserved; /* 0 */
} lpdeform_source;

/* A vertex attribute to write, at data + offset + i stride for vertex i. Bytes between are not changed. No alignment
 * is needed. */
typedef struct lpdeform_target {
  void* data;      /* NULL: not wanted */
  size_t bytes;    /* size of the whole buffer; nothing beyond is written */
  uint32_t offset; /* of the first vertex, in bytes */
  uint32_t stride; /* from vertex to vertex, in bytes; 0: without gaps */
  lpdeform_format format;
  uint32_t reserved; /* 0 */
} lpdeform_target;

/* ---- opening ---- */

typedef int32_t lpdeform_index_format;
enum { LPDEFORM_UINT32 = 0, LPDEFORM_UINT16 = 1 };

/* A triangle mesh in an engine's format. */
typedef struct lpdeform_mesh {
  uint32_t struct_size;
  uint32_t vertex_count;
  lpdeform_source positions; /* FLOAT32 or FLOAT64 */
  /* FLOAT32 or FLOAT64, as drawn at rest. In frames with normals, these follow the surface: hard edges stay hard,
   * and seams are invisible. Without them, frames have smooth normals. */
  lpdeform_source normals;
  const void* indices;  /* three per triangle */
  uint32_t index_count; /* a multiple of 3 */
  lpdeform_index_format index_format;
  /* Engines have several copies of a vertex along seams of texture coordinates or normals. 1: vertices in the same
   * place are welded: they deform as one vertex and get the same positions to the last bit. See weld_tolerance. */
  uint32_t weld_by_position;
  uint32_t reserved; /* 0 */
  /* Instead of weld_by_position: one number per vertex; vertices with the same number are welded. May be NULL. */
  const uint32_t* weld_groups;
  /* With weld_by_position: the largest distance of vertices to weld, as a share of the bounding box's diagonal, 0
   * to 0.001; 0 means the server's default, 1e-6. */
  double weld_tolerance;
} lpdeform_mesh;

/* The engine's coordinate system. The server's is that of glTF: right-handed, y up, metres, triangles
 * counter-clockwise seen from outside. */
typedef int32_t lpdeform_handedness;
enum {
  LPDEFORM_RIGHT_HANDED = 0,
  LPDEFORM_LEFT_HANDED = 1 /* Unity, Unreal. With y up, x changes its sign; with z up, y and z are swapped */
};
typedef int32_t lpdeform_up;
enum {
  LPDEFORM_Y_UP = 0, /* Unity, Godot */
  LPDEFORM_Z_UP = 1  /* Unreal, Blender */
};
/* The winding of triangles as a person sees them from outside; mirrored coordinates do not change it. Unreal, which
 * uses (C - A) x (B - A) in left-handed coordinates as the normal of A, B, C, is counter-clockwise. */
typedef int32_t lpdeform_winding;
enum {
  /* Clockwise if left-handed with y up (Unity), otherwise counter-clockwise (Unreal). */
  LPDEFORM_WINDING_USUAL = 0,
  LPDEFORM_COUNTER_CLOCKWISE = 1,
  LPDEFORM_CLOCKWISE = 2 /* also Godot */
};

/* The encoding of frames on the network. The C interface gives the same formats for all encodings. */
typedef int32_t lpdeform_encoding;
enum {
  LPDEFORM_ENCODING_RAW = 0,       /* 12 bytes per vertex, 28 with distortion and normals */
  LPDEFORM_ENCODING_QUANTIZED = 1, /* 8 bytes per vertex, with distortion; exact to 1/131070 of the extent */
  LPDEFORM_ENCODING_COMPRESSED = 2 /* the same numbers in about 3 bytes per vertex */
};

/* The weights of a cell's edges in the energy; see WeightKind in client/cpp/types.h. */
typedef int32_t lpdeform_weights;
enum { LPDEFORM_COTANGENT = 0, LPDEFORM_UNIFORM = 1, LPDEFORM_INTRINSIC_DELAUNAY = 2 };

/* What happens to a connected component that no handle holds. */
typedef int32_t lpdeform_free_components;
enum {
  /* lpdeform_poll returns COMPONENT_WITHOUT_HANDLE; the surface stays as it is */
  LPDEFORM_FREE_COMPONENTS_ERROR = 0,
  LPDEFORM_FREE_COMPONENTS_STAY = 1,  /* stays at rest */
  LPDEFORM_FREE_COMPONENTS_FOLLOW = 2 /* moves rigidly with the nearest handle */
};

typedef struct lpdeform_options {
  uint32_t struct_size;
  lpdeform_handedness handedness;
  lpdeform_up up;
  lpdeform_winding winding;
  double units_per_metre; /* 100 if the engine's unit is the centimetre (Unreal); 0 means 1 */
  lpdeform_weights weights;
  lpdeform_free_components free_components;
  lpdeform_encoding encoding;
  /* The least precise encoding to which a server with a limit of bytes per second may switch. */
  lpdeform_encoding lowest_encoding;
  uint32_t with_normals;        /* 1: frames have normals */
  uint32_t without_distortion;  /* 1: distortion is not needed; raw frames then have none */
  uint32_t double_precision;    /* 1: raw frames are sent as float64 */
  uint32_t certify;             /* 1: results are sent a second time with their optimality_gap */
  uint32_t credit;              /* frames that may be under way and not taken yet, 1 to 8; 0 means 2 */
  uint32_t reserved;            /* 0 */
  double max_frames_per_second; /* 0 means no limit; the last frame of an update is always sent */
} lpdeform_options;

/* Starts to create a session of the mesh on the server; `options` may be NULL. Handles may be set at once: they are
 * sent as soon as there is a session. Copies the mesh, which takes about a millisecond for 10,000 vertices. The
 * caller must pass the session to lpdeform_close. Errors: INVALID_ARGUMENT if a buffer is too small or an enum
 * unknown. If the server refuses the mesh, the state of the session becomes LPDEFORM_STATE_REFUSED later. */
LPDEFORM_API lpdeform_code lpdeform_open(lpdeform_client* client, const lpdeform_mesh* mesh,
                                         const lpdeform_options* options, lpdeform_session** session,
                                         lpdeform_error* error);

typedef int32_t lpdeform_role;
enum { LPDEFORM_READER = 0, LPDEFORM_WRITER = 1 /* replaces the present writer */ };

/* The same for a session that somebody else created, and which continues when this one is closed. `name` is that of
 * lpdeform_session_name. Ignores the `options` that belong to the mesh (weights, free_components). */
LPDEFORM_API lpdeform_code lpdeform_join(lpdeform_client* client, const char* name, lpdeform_role role,
                                         const lpdeform_options* options, lpdeform_session** session,
                                         lpdeform_error* error);

/* A session as a file: mesh, handles, settings, undo steps and the current surface. */
typedef struct lpdeform_snapshot lpdeform_snapshot;

/* WAITS for the session as a file, including every earlier change. Frames continue; changes made meanwhile are sent
 * after it. The caller must pass the snapshot to lpdeform_free_snapshot. Errors: FAILED_PRECONDITION NOT_CONNECTED
 * while there is no session on the server yet; DEADLINE_EXCEEDED after call_timeout_seconds; the server's error about
 * the snapshot or about an earlier change. */
LPDEFORM_API lpdeform_code lpdeform_take_snapshot(lpdeform_session* session, lpdeform_snapshot** snapshot,
                                                  lpdeform_error* error);
/* The bytes of the file, valid until the snapshot is freed. For a NULL snapshot: NULL and 0 bytes. Cannot fail. */
LPDEFORM_API const void* lpdeform_snapshot_data(const lpdeform_snapshot* snapshot, size_t* bytes);
/* Frees a snapshot, which may be NULL. */
LPDEFORM_API void lpdeform_free_snapshot(lpdeform_snapshot* snapshot);

/* As lpdeform_open, but from such a file, on any server of the same version or a later one. The surface is the same
 * to the last bit, in the coordinate system of `options`. Ignores the `options` that the file determines (weights,
 * free_components). If the file is not a snapshot, is damaged or of a newer version, the state becomes
 * LPDEFORM_STATE_REFUSED (SNAPSHOT_FOREIGN and so on). */
LPDEFORM_API lpdeform_code lpdeform_restore(lpdeform_client* client, const void* data, size_t bytes,
                                            const lpdeform_options* options, lpdeform_session** session,
                                            lpdeform_error* error);

/* Ends the session; the caller must not use it any more. It is closed on the server in the background. `session` may
 * be NULL. */
LPDEFORM_API void lpdeform_close(lpdeform_session* session);

typedef int32_t lpdeform_state;
enum {
  LPDEFORM_STATE_CONNECTING = 0, /* there is no session yet; `why` is the error of the last attempt */
  LPDEFORM_STATE_LIVE = 1,
  LPDEFORM_STATE_RECONNECTING = 2, /* the server is unreachable for now; the last frame stays valid */
  LPDEFORM_STATE_REFUSED = 3       /* the session has ended; `why` says why */
};

/* The state of the session. `why` may be NULL; its code is LPDEFORM_OK if there is no error. A NULL session is
 * REFUSED. */
LPDEFORM_API lpdeform_state lpdeform_session_state(const lpdeform_session* session, lpdeform_error* why);

/* Messages about the condition of the server or about the mesh; nothing failed. */
typedef int32_t lpdeform_notice;
enum {
  LPDEFORM_NOTICE_NONE = 0,
  LPDEFORM_NOTICE_OVERLOADED = 1, /* the server is overloaded: frames come less often */
  LPDEFORM_NOTICE_RECOVERED = 2,  /* no longer overloaded */
  LPDEFORM_NOTICE_OTHER = 3,      /* a notice that only newer servers send */
  LPDEFORM_NOTICE_MESH = 4, /* the mesh splits open where it is not welded. Until there is another notice */
  /* A shape of lower energy is known for the newest change: see lpdeform_take_better_shape. */
  LPDEFORM_NOTICE_BETTER_SHAPE = 5
};

/* BETTER_SHAPE while it applies: until the shape is shown, a frame for a later change arrives, or an lpdeform_solve
 * ends. Otherwise the last notice of the server about itself on the present connection, or about the mesh. NONE if there is none, and for a NULL
 * session. Writes one sentence for people to `text`, which has `bytes` bytes and may be NULL; it is cut like the texts of errors. Log
 * it when it changes. */
LPDEFORM_API lpdeform_notice lpdeform_session_notice(const lpdeform_session* session, char* text,
                                                     size_t bytes);

/* A shape of lower energy for the newest change. */
typedef struct lpdeform_better_shape {
  uint32_t struct_size;
  uint32_t reserved;  /* 0 */
  uint64_t input_seq; /* of the change */
  double energy;      /* of the shape, as lpdeform_frame.energy */
  double saved_share; /* the share of the present energy that the shape saves, 0 to 1 */
} lpdeform_better_shape;

/* The numbers of LPDEFORM_NOTICE_BETTER_SHAPE. LPDEFORM_NO_FRAME if no such notice applies; nothing is then written.
 * `better` may be NULL. INVALID_ARGUMENT for a NULL session. */
LPDEFORM_API lpdeform_code lpdeform_session_better_shape(const lpdeform_session* session,
                                                         lpdeform_better_shape* better,
                                                         lpdeform_error* error);

/* The name "sessions/<32 hexadecimal digits>", for lpdeform_join. It changes if the server loses the session.
 * FAILED_PRECONDITION while there is no session. INVALID_ARGUMENT if `bytes` is too small; 64 is enough. */
LPDEFORM_API lpdeform_code lpdeform_session_name(const lpdeform_session* session, char* name, size_t bytes,
                                                 lpdeform_error* error);

/* The number of vertices of the mesh; 0 while a joined or restored session is not open yet. */
LPDEFORM_API uint32_t lpdeform_vertex_count(const lpdeform_session* session);

/* ---- handles ---- */

typedef int32_t lpdeform_motion_kind;
enum {
  LPDEFORM_FIXED = 0,    /* stays at its rest positions */
  LPDEFORM_RIGID = 1,    /* x = R (p - center) + center + translation, p at rest; motions do not accumulate */
  LPDEFORM_POSITIONS = 2 /* absolute positions, one for each vertex or point */
};

typedef struct lpdeform_motion {
  lpdeform_motion_kind kind;
  uint32_t position_count; /* as many as the handle has vertices or points */
  /* Quaternion x, y, z, w in the engine's coordinates, of any length; all 0: no rotation. */
  double rotation[4];
  double center[3];
  double translation[3];
  const double* positions; /* 3 position_count */
} lpdeform_motion;

/* How a handle is held. */
typedef int32_t lpdeform_hold;
enum lpdeform_hold_values {
  LPDEFORM_EXACTLY = 0,
  LPDEFORM_SOFT = 1,        /* pulled to its target with `weight` */
  LPDEFORM_ORIENTATION = 2, /* has the motion's rotation with `weight`; its position is free */
  LPDEFORM_AXIS_LOCK = 3,   /* free to move along the line through its target in `direction` */
  LPDEFORM_PLANE_LOCK = 4   /* free to move in the plane through its target perpendicular to `direction` */
};

/* A point inside a face: the sum of barycentric coordinates times the face's corners, in their order. */
typedef struct lpdeform_point {
  uint32_t face;
  uint32_t reserved; /* 0 */
  double barycentric[3];
} lpdeform_point;

typedef struct lpdeform_handle {
  uint32_t struct_size;
  lpdeform_hold hold;
  const char* name;
  const uint32_t* vertices;     /* either vertices, each held by at most one handle; */
  const lpdeform_point* points; /* or points, held exactly or softly */
  uint32_t vertex_count;
  uint32_t point_count;
  lpdeform_motion motion;
  double weight;       /* up to 1e6; 0 means 1 (SOFT) or 100 (ORIENTATION) */
  double direction[3]; /* of any length but 0 */
  double footprint;    /* radius of the surroundings that move almost rigidly with the handle; 0: none */
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

/* Settings that are 0 or NULL keep their values. */
typedef struct lpdeform_settings {
  uint32_t struct_size;
  uint32_t p_count;           /* of p_per_vertex: the number of vertices */
  double p;                   /* 1 to 64, everywhere; */
  const double* p_per_vertex; /* or one per vertex; */
  double p_automatic;         /* or computed from the geometry with this strength, up to 1 */
  double stiffness;           /* 1e-6 to 1e6, everywhere; */
  const double* stiffness_per_vertex;
  double stiffness_automatic;
  uint32_t stiffness_count;
  uint32_t reserved;  /* 0 */
  double length_unit; /* of mixed norms; negative: back to the mean edge length */
  /* 1: the next four fields together replace the server's. */
  uint32_t set_solver;
  lpdeform_method method;
  double tolerance;
  double time_limit_seconds;
  uint32_t max_iterations;
  /* 1: from now on only the vertices of the region may move; with an empty region, all may. */
  uint32_t set_region;
  const uint32_t* region;
  uint32_t region_count;
  uint32_t reserved_too; /* 0 */
  /* With set_solver. 1: the next three fields say how far to look for lower minima once the first one is found; 0: they
   * are not read, and have their defaults. The energy has many minima where p is below 2. A session searches when nothing
   * changes for a second. lpdeform_solve searches with what is left of its limits, before it returns. */
  uint32_t set_search;
  /* The number of further starts is 12 times the effort, 1 to 1000. -1: no search, the first minimum is taken. 0: the
   * default, which is 1 if `method` is AUTO and p is below 2 somewhere, and for lpdeform_solve if it also starts cold;
   * otherwise there is no search. A start takes up to two or three times as long as the first minimum. Meshes of fewer than
   * 100 vertices are not searched. Meshes of more than 15,000 vertices are searched on their coarse levels, and only what
   * is lower there is tried on the mesh itself, as one further start. */
  int32_t search_effort;
  double search_least_share; /* the share of energy that a better shape must save, up to 1; 0 means 0.02 */
  uint32_t search_shows;     /* 1: a better shape is shown at once; 0: it is announced (BETTER_SHAPE) */
  uint32_t reserved_search;  /* 0 */
} lpdeform_settings;

/* A motion for an existing handle. */
typedef struct lpdeform_move {
  const char* name;
  lpdeform_motion motion;
} lpdeform_move;

/* A change of handles and settings. It is atomic: the server accepts all of it or nothing. */
typedef struct lpdeform_update {
  uint32_t struct_size;
  uint32_t set_count;
  const lpdeform_handle* sets; /* handles to add or replace */
  const lpdeform_move* moves;
  const char* const* removals;
  uint32_t move_count;
  uint32_t removal_count;
  const lpdeform_settings* settings; /* may be NULL */
  /* 1: the changes of handles begin a new step for lpdeform_undo. Set this when a drag begins. */
  uint32_t begins_step;
  uint32_t reserved; /* 0 */
} lpdeform_update;

/* Sends a change. Changes made faster than the connection can send them are merged: the newest value of each handle
 * and each setting wins. If `input_seq` is not NULL, it receives the number of the change: frames with at least this
 * input_seq include it. Errors: INVALID_ARGUMENT if the change is wrong by itself, NAME_ENCODING if a name is not
 * UTF-8. If the server refuses the change, lpdeform_poll returns the error once. For a reader: FAILED_PRECONDITION
 * NOT_THE_WRITER. When the session has ended: the error of lpdeform_session_state. */
LPDEFORM_API lpdeform_code lpdeform_send(lpdeform_session* session, const lpdeform_update* update,
                                         uint64_t* input_seq, lpdeform_error* error);

/* Adds the handle, or replaces the handle of the same name. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_set_handle(lpdeform_session* session, const lpdeform_handle* handle,
                                               uint64_t* input_seq, lpdeform_error* error);
/* Moves a handle. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_move_handle(lpdeform_session* session, const char* name,
                                                const lpdeform_motion* motion, uint64_t* input_seq,
                                                lpdeform_error* error);
/* Removes a handle. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_remove_handle(lpdeform_session* session, const char* name,
                                                  uint64_t* input_seq, lpdeform_error* error);
/* Changes p, stiffness and so on. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_set(lpdeform_session* session, const lpdeform_settings* settings,
                                        uint64_t* input_seq, lpdeform_error* error);

/* A scaling by different factors along three axes in which salient parts keep their shape and size. */
typedef struct lpdeform_resizing {
  uint32_t struct_size;
  uint32_t set_origin; /* 1: `origin` does not move; 0: the middle of the mesh's bounding box does not */
  uint32_t set_axes;   /* 1: the axes below; 0: the engine's x, y and z */
  uint32_t reserved;   /* 0 */
  double scale[3];     /* along the axes, relative to the mesh at rest: 0.01 to 100; 0 means 1 */
  double origin[3];
  double x_axis[3]; /* of any length but 0 */
  /* Only its part perpendicular to x_axis counts. The third axis is perpendicular to both. */
  double y_axis[3];
} lpdeform_resizing;

/* Scales the mesh: sets p and stiffness, and the handle "resize", which holds the ends of each component along the
 * scaled axes. Along other axes the extent changes unless plane locks hold the ends there. To end the resizing,
 * remove that handle and set p and stiffness. As lpdeform_send. */
LPDEFORM_API lpdeform_code lpdeform_resize(lpdeform_session* session, const lpdeform_resizing* resizing,
                                           uint64_t* input_seq, lpdeform_error* error);

/* WAITS until the server has undone the newest step of the handles. This is a change as in lpdeform_send: frames
 * follow. A step is what a person sees as one change. Consecutive changes that move the same handles, each at most a
 * second after the previous one, are one step; every other change of handles is a step of its own.
 * lpdeform_update.begins_step always begins a new step. Settings are not part of steps. Errors: FAILED_PRECONDITION
 * (NOTHING_TO_UNDO, also for steps from before the server lost the session; NOT_CONNECTED while there is no session
 * on the server yet; NOT_THE_WRITER), DEADLINE_EXCEEDED after call_timeout_seconds, and the server's error about an
 * earlier change. */
LPDEFORM_API lpdeform_code lpdeform_undo(lpdeform_session* session, uint64_t* input_seq,
                                         lpdeform_error* error);
/* Redoes the step that was undone last. As lpdeform_undo; NOTHING_TO_REDO. */
LPDEFORM_API lpdeform_code lpdeform_redo(lpdeform_session* session, uint64_t* input_seq,
                                         lpdeform_error* error);

/* WAITS until the server has taken the better shape that LPDEFORM_NOTICE_BETTER_SHAPE announces. It comes as a new final
 * frame for the same change. It is not part of steps for lpdeform_undo. Not retried: after UNAVAILABLE or
 * DEADLINE_EXCEEDED the shape may have been taken, which a frame then shows. lpdeform_solve makes the server forget the
 * shape; the session then searches again. Errors: FAILED_PRECONDITION (NO_BETTER_SHAPE if none is known for the newest
 * change, as after lpdeform_solve; NOT_CONNECTED; NOT_THE_WRITER), UNAVAILABLE,
 * DEADLINE_EXCEEDED after call_timeout_seconds. */
LPDEFORM_API lpdeform_code lpdeform_take_better_shape(lpdeform_session* session, lpdeform_error* error);

/* ---- frames ---- */

/* Where to write a frame, in the engine's coordinates. */
typedef struct lpdeform_buffers {
  uint32_t struct_size;
  uint32_t reserved;          /* 0 */
  lpdeform_target positions;  /* FLOAT32, FLOAT64 or UNORM16 */
  lpdeform_target normals;    /* FLOAT32, FLOAT64, SNORM16 or SNORM8; needs with_normals */
  lpdeform_target colours;    /* FLOAT32, RGBA8 or BGRA8: distortion from blue (none) to red */
  lpdeform_target distortion; /* FLOAT32 or FLOAT64: E_i of each vertex, lengths in metres */
  /* The distortion that is shown in full red. 0: the frame's 95th percentile. */
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

/* The description of a frame. */
typedef struct lpdeform_frame {
  uint32_t struct_size;
  uint32_t vertex_count;
  uint64_t input_seq; /* the newest change that the frame includes */
  uint64_t frame_seq;
  uint64_t epoch;
  uint64_t skipped_inputs; /* changes since the previous frame for which there is no frame */
  uint32_t iteration;
  /* 1: final, however the solve ended. No further frame until there is a new change, except this one again with its
   * optimality_gap (certify), and a better shape that is taken or shown. */
  uint32_t is_final;
  lpdeform_stop_reason stop_reason;
  uint32_t has_optimality_gap;
  double energy; /* lengths in metres */
  double soft_energy;
  double solve_seconds;
  double optimality_gap; /* valid if has_optimality_gap; see OpenOptions::certify in client/cpp/client.h */
  double red_distortion; /* used for the colours; 0 without colours */
  double origin[3];      /* for UNORM16 positions, in the engine's coordinates; otherwise 0 */
  double extent[3];
} lpdeform_frame;

/* Takes the newest frame that was not taken yet, and writes it. LPDEFORM_NO_FRAME if there is none. In this case, and
 * with all errors, nothing is written, and the buffers keep their content. `frame` may be NULL. Errors: the server's
 * error about a change (once; the session continues); when the session has ended, the reason; INVALID_ARGUMENT if a
 * buffer is too small or its attribute cannot have that format; FAILED_PRECONDITION if the buffers ask for normals or
 * distortion but the session was opened without. After the last two errors, the frame can still be taken. */
LPDEFORM_API lpdeform_code lpdeform_poll(lpdeform_session* session, const lpdeform_buffers* buffers,
                                         lpdeform_frame* frame, lpdeform_error* error);

/* Writes the frame that was taken last (by any thread) again, for engines whose buffers do not keep their content.
 * Works also while the server is unreachable and after the session has ended. LPDEFORM_NO_FRAME if no frame was taken
 * yet. */
LPDEFORM_API lpdeform_code lpdeform_repeat(lpdeform_session* session, const lpdeform_buffers* buffers,
                                           lpdeform_frame* frame, lpdeform_error* error);

/* WAITS for the final result of the newest change, and writes it; for tools and loading screens. Takes frames
 * meanwhile. Returns at once if that result was taken before. DEADLINE_EXCEEDED on timeout; other errors as
 * lpdeform_poll. */
LPDEFORM_API lpdeform_code lpdeform_settle(lpdeform_session* session, double timeout_seconds,
                                           const lpdeform_buffers* buffers, lpdeform_frame* frame,
                                           lpdeform_error* error);

/* What lpdeform_solve has searched. frame.optimality_gap does not say it: it is about the rotations of the result, and
 * another minimum may be lower. The library writes all fields but the first three. */
typedef struct lpdeform_search {
  uint32_t struct_size;
  uint32_t minima_capacity; /* how many numbers `minima` has room for */
  /* Receives the energies of minima, in order, as many as there is room for: the first one, then one for each start of the
   * search for lower ones that has converged, or has come back to the lowest minimum, whose energy it then has. Several starts
   * may come to the same minimum. frame.energy is the lowest. May be NULL with minima_capacity 0. */
  double* minima;
  /* How many energies there are, also if it is more than minima_capacity: up to 1 + further_starts. 0 if a limit has ended
   * the solve before the first minimum, and with a server that is older than the search. */
  uint32_t minima_count;
  uint32_t further_starts;    /* of the search, including those that were given up, which have no energy */
  uint32_t search_iterations; /* the part of frame.iteration that the search made */
  uint32_t effort;            /* of the search: search_effort, or the default; 0 is no search */
} lpdeform_search;

typedef struct lpdeform_solve_options {
  uint32_t struct_size;
  uint32_t certify;        /* 1: compute frame.optimality_gap */
  double timeout_seconds;  /* of the whole call, including the wait for another solve; 0 means no limit */
  lpdeform_search* search; /* is written if the call returns LPDEFORM_OK. May be NULL */
} lpdeform_solve_options;

/* WAITS for a complete solve for the current handles and settings, and writes the result in full precision; for
 * tools. Takes no frames: frame_seq and epoch are 0. Normals do not require with_normals. `options` may be NULL. Only
 * one solve runs at a time. Changes made meanwhile are sent after it, and frames show them only then. Errors: what
 * the server refuses; DEADLINE_EXCEEDED; UNAVAILABLE if the server was unreachable for reconnect_seconds; after
 * lpdeform_disconnect CANCELLED or, if the solve had not begun, FAILED_PRECONDITION SESSION_CLOSED. It is not an
 * error if the solve stopped before it converged: see frame.stop_reason. */
LPDEFORM_API lpdeform_code lpdeform_solve(lpdeform_session* session, const lpdeform_solve_options* options,
                                          const lpdeform_buffers* buffers, lpdeform_frame* frame,
                                          lpdeform_error* error);

#ifdef __cplusplus
}
#endif

#endif /* LPDEFORM_H_ */
