// Requests to the server. Addresses are relative: the page's own has the token.

/** The server's labels are not those that a gesture was made for. */
export class Stale extends Error {}
/** A gesture does not fit; the message tells the user why. */
export class Refused extends Error {}
/** What was asked for is still being made. */
export class NotYet extends Error {}
/** The server does not answer. */
export class Gone extends Error {}

async function ask(path: string, init?: RequestInit): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(path, { cache: "no-store", ...init });
  } catch {
    throw new Gone("The server does not answer.");
  }
  if (response.ok) return response;
  const said: unknown = await response.json().catch(() => null);
  const words =
    typeof said === "object" && said !== null && "error" in said
      ? String(said.error)
      : `The server answers ${response.status} to ${path}.`;
  if (response.status === 409) throw new Stale(words);
  if (response.status === 422) throw new Refused(words);
  if (response.status === 503) throw new NotYet(words);
  throw new Error(words);
}

export const readJson = async <T>(path: string): Promise<T> => (await (await ask(path)).json()) as T;

export async function readBytes(path: string, length: number): Promise<ArrayBuffer> {
  const bytes = await (await ask(path)).arrayBuffer();
  if (bytes.byteLength !== length)
    throw new Error(`${path} has ${bytes.byteLength} bytes, and ${length} are needed.`);
  return bytes;
}

export async function post<T>(path: string, body: unknown): Promise<T> {
  const headers = { "content-type": "application/json" };
  const answer = await ask(path, { method: "POST", headers, body: JSON.stringify(body) });
  return (await answer.json()) as T;
}

/** An image of the server, decoded. */
export async function readImage(path: string): Promise<HTMLImageElement> {
  const image = new Image();
  image.src = path;
  await image.decode().catch(() => {
    throw new Error(`${path} cannot be shown.`);
  });
  return image;
}
