// What is asked of the server, and how often.

export class Refused extends Error {
  constructor(sentence, keys) {
    super(sentence);
    this.keys = keys;
  }
}

/** The answer to `body` under that name. Raises Refused with the sentence of wrong input. */
export async function ask(name, body = {}) {
  const offline = document.getElementById("offline");
  let response;
  try {
    response = await fetch(`api/${name}`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(body),
    });
  } catch {
    offline.textContent = "The program behind this page has ended: start iceslide app again.";
    offline.hidden = false;
    throw new Refused(offline.textContent, []);
  }
  offline.hidden = true;
  const answer = await response.json().catch(() => ({}));
  if (!response.ok) {
    throw new Refused(answer.sentence ?? `The program has failed (${response.status}).`, answer.keys ?? []);
  }
  return answer;
}

/** A function that runs `work`, never twice at once; of calls while it works only the last counts. */
export function latest(work) {
  let busy = false;
  let next = null;
  return async function call(...args) {
    next = args;
    if (busy) return;
    busy = true;
    try {
      while (next) {
        const now = next;
        next = null;
        await work(...now, () => next !== null);
      }
    } finally {
      busy = false;
    }
  };
}

/** A function that runs `work` when it has not been called for `ms`. */
export function settled(work, ms) {
  let timer;
  return (...args) => {
    clearTimeout(timer);
    timer = setTimeout(() => work(...args), ms);
  };
}
