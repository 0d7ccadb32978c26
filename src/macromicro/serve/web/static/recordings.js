// What is being recorded, and the recordings that can be had.

const $ = (id) => document.getElementById(id);

export class Recordings {
  constructor(link, page) {
    this.link = link;
    this.page = page; // say(words, bad), put(element, words)
    this.key = "";
  }

  show(now) {
    const { active, rows, lost, path } = now.recording, { put } = this.page;
    $("record").setAttribute("aria-pressed", String(active));
    put($("record"), active ? "End the recording" : "Record");
    put($("recording"), active ? `Recording into ${path}: ${rows} rows${lost ? `, ${lost} lost` : ""}` : "Nothing is being recorded.");
    const key = now.recordings.map((r) => `${r.name}${r.active}${r.active ? "" : r.bytes}`).join();
    if (this.key === key) return;
    this.key = key;
    $("recordings").replaceChildren(...now.recordings.filter((r) => !r.active).map((r) => {
      const item = document.createElement("li"), button = document.createElement("button");
      const share = document.createElement("span");
      button.textContent = `Download ${r.name} (${(r.bytes / 1e6).toFixed(2)} MB)`;
      button.addEventListener("click", () => this.save(r.name, share));
      item.append(button, " ", share);
      return item;
    }));
  }

  // How far it is stands beside the button: read aloud are only its beginning and its end.
  async save(name, share) {
    const say = this.page.say;
    say(`${name}: downloading.`);
    try {
      const file = await this.link.download(name, (part) => { share.textContent = `${(part * 100).toFixed(0)} %`; });
      const anchor = document.createElement("a");
      anchor.href = URL.createObjectURL(file);
      anchor.download = name;
      anchor.click();
      setTimeout(() => URL.revokeObjectURL(anchor.href), 60000);
      say(`${name}: downloaded.`);
    } catch (error) {
      say(`${name}: ${error.message}`, true);
    }
    share.textContent = "";
  }
}
