// Little-endian fields, one by one: the browser's side of core/wire/bytes.h.

/** What a body or a message was found to be when it is not what the contract says. */
export class ContractError extends Error {
  override name = "ContractError";
}

const text_decoder = new TextDecoder("utf-8", { fatal: true });
const text_encoder = new TextEncoder();

/** Reads past the end throw, naming the offset, so no length has to be trusted. */
export class ByteReader {
  private readonly view: DataView;
  private at = 0;

  constructor(
    private readonly bytes: Uint8Array,
    private readonly what: string,
  ) {
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get offset(): number {
    return this.at;
  }
  get left(): number {
    return this.bytes.byteLength - this.at;
  }

  u8(): number {
    return this.view.getUint8(this.take(1));
  }
  u16(): number {
    return this.view.getUint16(this.take(2), true);
  }
  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }
  i32(): number {
    return this.view.getInt32(this.take(4), true);
  }
  u64(): bigint {
    return this.view.getBigUint64(this.take(8), true);
  }
  f64(): number {
    return this.view.getFloat64(this.take(8), true);
  }
  vec3(): [number, number, number] {
    return [this.f64(), this.f64(), this.f64()];
  }
  /** A length as u32, then that many bytes of UTF-8. */
  text(): string {
    const length = this.u32();
    const start = this.take(length);
    try {
      return text_decoder.decode(this.bytes.subarray(start, start + length));
    } catch {
      throw this.error("text that is not UTF-8");
    }
  }
  /** Copies, so that the array is aligned whatever lies before it. */
  f32Array(count: number): Float32Array<ArrayBuffer> {
    return new Float32Array(this.copy(count * 4));
  }
  u32Array(count: number): Uint32Array<ArrayBuffer> {
    return new Uint32Array(this.copy(count * 4));
  }
  i16Array(count: number): Int16Array<ArrayBuffer> {
    return new Int16Array(this.copy(count * 2));
  }
  u16Array(count: number): Uint16Array<ArrayBuffer> {
    return new Uint16Array(this.copy(count * 2));
  }

  end(): void {
    if (this.left !== 0) throw this.error(`${this.left} bytes left over`);
  }
  error(problem: string): ContractError {
    return new ContractError(`${this.what}: ${problem} at byte ${this.at}`);
  }

  private copy(size: number): ArrayBuffer {
    const start = this.take(size);
    return this.bytes.slice(start, start + size).buffer as ArrayBuffer;
  }
  private take(size: number): number {
    if (size > this.left) throw this.error(`needs ${size} bytes, has ${this.left}`);
    const start = this.at;
    this.at += size;
    return start;
  }
}

export class ByteWriter {
  private view: DataView<ArrayBuffer>;
  private at = 0;

  constructor(size = 64) {
    this.view = new DataView(new ArrayBuffer(size));
  }

  u8(v: number): void {
    const at = this.grow(1);
    this.view.setUint8(at, v);
  }
  u16(v: number): void {
    const at = this.grow(2);
    this.view.setUint16(at, v, true);
  }
  u32(v: number): void {
    const at = this.grow(4);
    this.view.setUint32(at, v, true);
  }
  u64(v: bigint): void {
    const at = this.grow(8);
    this.view.setBigUint64(at, v, true);
  }
  f64(v: number): void {
    const at = this.grow(8);
    this.view.setFloat64(at, v, true);
  }
  text(v: string): void {
    const bytes = text_encoder.encode(v);
    this.u32(bytes.length);
    const at = this.grow(bytes.length);
    new Uint8Array(this.view.buffer).set(bytes, at);
  }
  bytes(): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.view.buffer.slice(0, this.at));
  }

  private grow(size: number): number {
    const at = this.at;
    this.at += size;
    if (this.at > this.view.byteLength) {
      const bigger = new Uint8Array(new ArrayBuffer(Math.max(this.at, 2 * this.view.byteLength)));
      bigger.set(new Uint8Array(this.view.buffer));
      this.view = new DataView(bigger.buffer);
    }
    return at;
  }
}

/** How state hashes are shown and compared: 16 hexadecimal digits. */
export function hashText(hash: bigint): string {
  return hash.toString(16).padStart(16, "0");
}
