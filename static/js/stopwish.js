// That a stop was asked for and is not confirmed: kept over a reload of the page, which must not end the asking.

const KEPT_AS = "footfall-stop";

export const stopIsWished = () => sessionStorage.setItem(KEPT_AS, "asked");
export const stopIsConfirmed = () => sessionStorage.removeItem(KEPT_AS);
export const stopIsUnconfirmed = () => sessionStorage.getItem(KEPT_AS) !== null;
