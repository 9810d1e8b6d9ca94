import type { MessageInitShape, MessageShape } from "@bufbuild/protobuf";
import { type CallOptions, type Client, createClient, type Interceptor, type Transport } from "@connectrpc/connect";
import { createGrpcWebTransport } from "@connectrpc/connect-web";
import { fromCall } from "./errors.js";
import { DeformService } from "./gen/lpdeform/v1/service_pb.js";
import { StreamHub } from "./hub.js";
import { explained } from "./origin.js";
import { bearing } from "./token.js";
import type { ConnectOptions } from "./types.js";
import { newRequestId } from "./requestid.js";

type Methods = typeof DeformService.method;
type Unary = { [Name in keyof Methods]: Methods[Name]["methodKind"] extends "unary" ? Name : never }[keyof Methods];

type Shared = Map<string, Rpc>;
const withoutToken: Shared = new Map();
const byToken = new WeakMap<object, Shared>();

/** The connections of callers with the same token. */
function sharedBy(token: ConnectOptions["token"]): Shared {
  if (!token) return withoutToken;
  const known = byToken.get(token) ?? new Map();
  byToken.set(token, known);
  return known;
}

/**
 * Lets a proxy in front of several servers send all calls of a page to one of them, which sessions that share a stream need.
 */
function keepTogether(id: string): Interceptor {
  return (next) => (request) => {
    request.header.set("lpdeform-session", id);
    return next(request);
  };
}

/** Marks a call, on its way to fetch(), that outlives the page. */
const keepaliveHeader = "lpdeform-keepalive";

function fetchBy(own: ConnectOptions["fetch"]): typeof globalThis.fetch {
  return (input, init) => {
    const headers = new Headers(init?.headers);
    const keepalive = headers.has(keepaliveHeader);
    headers.delete(keepaliveHeader);
    return (own ?? globalThis.fetch)(input, keepalive ? { ...init, headers, keepalive } : init);
  };
}

/** The calls of the service. Every error is thrown as an LpdeformError. */
export class Rpc {
  readonly client: Client<typeof DeformService>;
  readonly hub = new StreamHub(this);
  /**
   * Three heartbeats: a stream that is silent for longer counts as dead. Heartbeats are 15 s apart until a stream says
   * otherwise.
   */
  longestSilenceMs = 45_000;

  constructor(
    transport: Transport,
    readonly callTimeoutMs = 30_000,
    readonly reconnectForMs = 120_000,
  ) {
    this.client = createClient(DeformService, transport);
  }

  /**
   * Returns the same object for the same options, so that sessions share a stream. `route`: see goingBy(); a default is used if
   * it is empty.
   */
  static connect(options: ConnectOptions, route = ""): Rpc {
    const { url, callTimeoutMs, reconnectForMs, token, fetch } = options;
    const baseUrl = url ?? globalThis.location?.origin;
    if (!baseUrl) throw new TypeError("Outside of a page, `url` is needed: of the gRPC-Web proxy.");
    const key = `${baseUrl} ${callTimeoutMs} ${reconnectForMs} ${route}`;
    const shared = fetch ? undefined : sharedBy(token);
    const known = shared?.get(key);
    if (known) return known;
    const id = route || newRequestId();
    const interceptors = [keepTogether(id), ...(token ? [bearing(token)] : [])];
    const transport = createGrpcWebTransport({ baseUrl, interceptors, fetch: fetchBy(fetch) });
    const rpc = new Rpc(transport, callTimeoutMs, reconnectForMs);
    rpc.#route = id;
    if (!fetch) rpc.#baseUrl = baseUrl;
    rpc.#another = (other) => Rpc.connect(options, other);
    shared?.set(key, rpc);
    return rpc;
  }

  #route = "";
  #baseUrl = "";
  /** Whether a call was ever answered. Then errors have nothing to do with what the proxy allows. */
  #wasAnswered = false;
  #another: ((route: string) => Rpc) | undefined;

  /**
   * The same server or proxy with another value of the header lpdeform-session, by which a proxy chooses among several servers.
   */
  goingBy(route: string): Rpc {
    return route === this.#route ? this : (this.#another?.(route) ?? this);
  }

  /** `keepalive`: the call goes on if the page is left. */
  async call<Name extends Unary>(
    name: Name,
    request: MessageInitShape<Methods[Name]["input"]>,
    signal?: AbortSignal,
    keepalive = false,
  ): Promise<MessageShape<Methods[Name]["output"]>> {
    type Call = (request: unknown, options: CallOptions) => Promise<MessageShape<Methods[Name]["output"]>>;
    try {
      const answer = await (this.client[name] as unknown as Call)(request, {
        timeoutMs: this.callTimeoutMs,
        ...(signal && { signal }),
        ...(keepalive && { headers: { [keepaliveHeader]: "yes" } }),
      });
      this.#wasAnswered = true;
      return answer;
    } catch (thrown) {
      const error = fromCall(thrown);
      throw this.#wasAnswered || !this.#baseUrl ? error : await explained(error, this.#baseUrl);
    }
  }
}
