// Search in a site that is read from files, where browsers refuse workers: the worker's script
// runs in a hidden frame instead. The name is the one that Material's search looks for.
window.IFrameWorker = class extends EventTarget {
  constructor(url) {
    super();
    this.onmessage = null;
    this.frame = document.createElement("iframe");
    this.frame.hidden = true;
    document.body.appendChild(this.frame);
    const place = this.frame.contentWindow.document;
    place.open();
    place.write(
      "<html><body><script>postMessage = (data) => parent.postMessage(data, '*');" +
        "importScripts = (...scripts) => Promise.all(scripts.map((src) => new Promise((done) => {" +
        "const script = document.createElement('script'); script.src = src;" +
        "script.onload = done; document.body.appendChild(script); })))</scr" +
        "ipt><script src='" + url + "'></scr" + "ipt></body></html>"
    );
    place.close();
    this.listen = (event) => {
      if (event.source !== this.frame.contentWindow) return;
      const message = new MessageEvent("message", { data: event.data });
      this.dispatchEvent(message);
      if (this.onmessage) this.onmessage(message);
    };
    addEventListener("message", this.listen);
    this.ready = new Promise((done) => { this.frame.onload = done; });
  }
  postMessage(data) {
    this.ready.then(() => this.frame.contentWindow.dispatchEvent(new MessageEvent("message", { data })));
  }
  terminate() {
    removeEventListener("message", this.listen);
    this.frame.remove();
  }
};
if (location.protocol === "file:") window.Worker = window.IFrameWorker;
