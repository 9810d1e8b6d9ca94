import type { MessageInitShape, MessageShape } from "@bufbuild/protobuf";
import { type CallOptions, type Client, createClient, type Transport } from "@connectrpc/connect";
import { createGrpcWebTransport } from "@connectrpc/connect-web";
import { fromCall } from "./errors.js";
import { DeformService } from "./gen/lpdeform/v1/service_pb.js";
import type { ConnectOptions } from "./types.js";

type Methods = typeof DeformService.method;
type Unary = { [Name in keyof Methods]: Methods[Name]["methodKind"] extends "unary" ? Name : never }[keyof Methods];

/** The calls of the service. Every error that comes out is an LpdeformError. */
export class Rpc {
  readonly client: Client<typeof DeformService>;

  constructor(
    transport: Transport,
    readonly callTimeoutMs = 30_000,
    readonly reconnectForMs = 120_000,
  ) {
    this.client = createClient(DeformService, transport);
  }

  static connect(options: ConnectOptions): Rpc {
    const baseUrl = options.url ?? globalThis.location?.origin;
    if (!baseUrl) throw new TypeError("Outside of a page, `url` is needed: of the gRPC-Web proxy.");
    const transport = createGrpcWebTransport({ baseUrl, ...(options.fetch && { fetch: options.fetch }) });
    return new Rpc(transport, options.callTimeoutMs, options.reconnectForMs);
  }

  async call<Name extends Unary>(
    name: Name,
    request: MessageInitShape<Methods[Name]["input"]>,
    signal?: AbortSignal,
  ): Promise<MessageShape<Methods[Name]["output"]>> {
    type Call = (request: unknown, options: CallOptions) => Promise<MessageShape<Methods[Name]["output"]>>;
    try {
      return await (this.client[name] as unknown as Call)(request, {
        timeoutMs: this.callTimeoutMs,
        ...(signal && { signal }),
      });
    } catch (thrown) {
      throw fromCall(thrown);
    }
  }
}
