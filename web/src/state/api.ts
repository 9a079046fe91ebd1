// The server's REST interface. Every failure becomes an Error with one sentence that a person can read.
import {
  decodeMesh,
  decodePointVolume,
  decodeVolume,
  type MeshBody,
  type VolumeBody,
} from "../contract/bodies";
import type {
  CaseDetail,
  CaseSummary,
  NewPath,
  PathInfo,
  Problem,
  RecordingInfo,
  SessionInfo,
} from "../contract/rest";

export class ApiError extends Error {
  override name = "ApiError";
  constructor(
    message: string,
    readonly status: number,
  ) {
    super(message);
  }
}

async function request(path: string, init?: RequestInit): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(`/api/v1${path}`, init);
  } catch {
    throw new ApiError("The server does not answer. Is `spinaltap serve` still running?", 0);
  }
  if (!response.ok) throw new ApiError(await problemText(response), response.status);
  return response;
}

async function problemText(response: Response): Promise<string> {
  const fallback = `The server answered ${response.status} ${response.statusText}`.trim();
  try {
    const problem = (await response.json()) as Problem;
    return problem.detail ?? problem.title ?? fallback;
  } catch {
    return fallback;
  }
}

async function json<T>(path: string, init?: RequestInit): Promise<T> {
  return (await (await request(path, init)).json()) as T;
}

async function bytes(path: string): Promise<Uint8Array<ArrayBuffer>> {
  return new Uint8Array(await (await request(path)).arrayBuffer());
}

const part = encodeURIComponent;

export async function fetchCases(): Promise<CaseSummary[]> {
  return (await json<{ cases: CaseSummary[] }>("/cases")).cases;
}
export function fetchCase(id: string): Promise<CaseDetail> {
  return json<CaseDetail>(`/cases/${part(id)}`);
}
export async function fetchMesh(id: string): Promise<MeshBody> {
  return decodeMesh(await bytes(`/cases/${part(id)}/mesh`));
}
export function meshFileUrl(id: string, format: "stl" | "ply"): string {
  return `/api/v1/cases/${part(id)}/mesh.${format}`;
}
export async function fetchVolume(id: string): Promise<VolumeBody> {
  return decodeVolume(await bytes(`/cases/${part(id)}/volume`));
}
/** Both as bytes, for the core, and decoded, for drawing. */
export async function fetchPointVolume(case_id: string, path_id: string) {
  const raw = await bytes(`/cases/${part(case_id)}/paths/${part(path_id)}/point-volume`);
  return { raw, body: decodePointVolume(raw) };
}
export function fetchRecording(id: string): Promise<Uint8Array<ArrayBuffer>> {
  return bytes(`/recordings/${part(id)}`);
}
function sent(method: string, body: unknown): RequestInit {
  return { method, headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
}
/** Also a path that is no longer in the plan. */
export function fetchPath(case_id: string, path_id: string): Promise<PathInfo> {
  return json<PathInfo>(`/cases/${part(case_id)}/paths/${part(path_id)}`);
}
export function addPath(case_id: string, path: NewPath): Promise<PathInfo> {
  return json<PathInfo>(`/cases/${part(case_id)}/paths`, sent("POST", path));
}
/** The answer has another id when the path was drilled: that one stays as it was. */
export function replacePath(case_id: string, path_id: string, path: NewPath): Promise<PathInfo> {
  return json<PathInfo>(`/cases/${part(case_id)}/paths/${part(path_id)}`, sent("PUT", path));
}
export async function removePath(case_id: string, path_id: string): Promise<void> {
  await request(`/cases/${part(case_id)}/paths/${part(path_id)}`, { method: "DELETE" });
}
export function createSession(case_id: string, path_id: string): Promise<SessionInfo> {
  return json<SessionInfo>("/sessions", sent("POST", { case_id, path_id }));
}
export function socketUrl(session_id: string): string {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  return `${scheme}//${location.host}/ws/drill/${part(session_id)}`;
}

export function findRecording(detail: CaseDetail, id: string): RecordingInfo | null {
  return detail.recordings.find((recording) => recording.id === id) ?? null;
}
